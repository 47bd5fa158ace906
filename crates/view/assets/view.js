/*
three

The MIT License

Copyright (c) 2010-2026 three.js authors

Permission is hereby granted, free of charge, to any person obtaining a copy
of this software and associated documentation files (the "Software"), to deal
in the Software without restriction, including without limitation the rights
to use, copy, modify, merge, publish, distribute, sublicense, and/or sell
copies of the Software, and to permit persons to whom the Software is
furnished to do so, subject to the following conditions:

The above copyright notice and this permission notice shall be included in
all copies or substantial portions of the Software.

THE SOFTWARE IS PROVIDED "AS IS", WITHOUT WARRANTY OF ANY KIND, EXPRESS OR
IMPLIED, INCLUDING BUT NOT LIMITED TO THE WARRANTIES OF MERCHANTABILITY,
FITNESS FOR A PARTICULAR PURPOSE AND NONINFRINGEMENT. IN NO EVENT SHALL THE
AUTHORS OR COPYRIGHT HOLDERS BE LIABLE FOR ANY CLAIM, DAMAGES OR OTHER
LIABILITY, WHETHER IN AN ACTION OF CONTRACT, TORT OR OTHERWISE, ARISING FROM,
OUT OF OR IN CONNECTION WITH THE SOFTWARE OR THE USE OR OTHER DEALINGS IN
THE SOFTWARE.

uplot

The MIT License (MIT)

Copyright (c) 2022 Leon Sorokin

Permission is hereby granted, free of charge, to any person obtaining a copy
of this software and associated documentation files (the "Software"), to deal
in the Software without restriction, including without limitation the rights
to use, copy, modify, merge, publish, distribute, sublicense, and/or sell
copies of the Software, and to permit persons to whom the Software is
furnished to do so, subject to the following conditions:

The above copyright notice and this permission notice shall be included in
all copies or substantial portions of the Software.

THE SOFTWARE IS PROVIDED "AS IS", WITHOUT WARRANTY OF ANY KIND, EXPRESS OR
IMPLIED, INCLUDING BUT NOT LIMITED TO THE WARRANTIES OF MERCHANTABILITY,
FITNESS FOR A PARTICULAR PURPOSE AND NONINFRINGEMENT. IN NO EVENT SHALL THE
AUTHORS OR COPYRIGHT HOLDERS BE LIABLE FOR ANY CLAIM, DAMAGES OR OTHER
LIABILITY, WHETHER IN AN ACTION OF CONTRACT, TORT OR OTHERWISE, ARISING FROM,
OUT OF OR IN CONNECTION WITH THE SOFTWARE OR THE USE OR OTHER DEALINGS IN
THE SOFTWARE.

toml-eslint-parser

MIT License

Copyright (c) 2021 Yosuke Ota

Permission is hereby granted, free of charge, to any person obtaining a copy
of this software and associated documentation files (the "Software"), to deal
in the Software without restriction, including without limitation the rights
to use, copy, modify, merge, publish, distribute, sublicense, and/or sell
copies of the Software, and to permit persons to whom the Software is
furnished to do so, subject to the following conditions:

The above copyright notice and this permission notice shall be included in all
copies or substantial portions of the Software.

THE SOFTWARE IS PROVIDED "AS IS", WITHOUT WARRANTY OF ANY KIND, EXPRESS OR
IMPLIED, INCLUDING BUT NOT LIMITED TO THE WARRANTIES OF MERCHANTABILITY,
FITNESS FOR A PARTICULAR PURPOSE AND NONINFRINGEMENT. IN NO EVENT SHALL THE
AUTHORS OR COPYRIGHT HOLDERS BE LIABLE FOR ANY CLAIM, DAMAGES OR OTHER
LIABILITY, WHETHER IN AN ACTION OF CONTRACT, TORT OR OTHERWISE, ARISING FROM,
OUT OF OR IN CONNECTION WITH THE SOFTWARE OR THE USE OR OTHER DEALINGS IN THE
SOFTWARE.

eslint-visitor-keys

Apache License
                           Version 2.0, January 2004
                        http://www.apache.org/licenses/

   TERMS AND CONDITIONS FOR USE, REPRODUCTION, AND DISTRIBUTION

   1. Definitions.

      "License" shall mean the terms and conditions for use, reproduction,
      and distribution as defined by Sections 1 through 9 of this document.

      "Licensor" shall mean the copyright owner or entity authorized by
      the copyright owner that is granting the License.

      "Legal Entity" shall mean the union of the acting entity and all
      other entities that control, are controlled by, or are under common
      control with that entity. For the purposes of this definition,
      "control" means (i) the power, direct or indirect, to cause the
      direction or management of such entity, whether by contract or
      otherwise, or (ii) ownership of fifty percent (50%) or more of the
      outstanding shares, or (iii) beneficial ownership of such entity.

      "You" (or "Your") shall mean an individual or Legal Entity
      exercising permissions granted by this License.

      "Source" form shall mean the preferred form for making modifications,
      including but not limited to software source code, documentation
      source, and configuration files.

      "Object" form shall mean any form resulting from mechanical
      transformation or translation of a Source form, including but
      not limited to compiled object code, generated documentation,
      and conversions to other media types.

      "Work" shall mean the work of authorship, whether in Source or
      Object form, made available under the License, as indicated by a
      copyright notice that is included in or attached to the work
      (an example is provided in the Appendix below).

      "Derivative Works" shall mean any work, whether in Source or Object
      form, that is based on (or derived from) the Work and for which the
      editorial revisions, annotations, elaborations, or other modifications
      represent, as a whole, an original work of authorship. For the purposes
      of this License, Derivative Works shall not include works that remain
      separable from, or merely link (or bind by name) to the interfaces of,
      the Work and Derivative Works thereof.

      "Contribution" shall mean any work of authorship, including
      the original version of the Work and any modifications or additions
      to that Work or Derivative Works thereof, that is intentionally
      submitted to Licensor for inclusion in the Work by the copyright owner
      or by an individual or Legal Entity authorized to submit on behalf of
      the copyright owner. For the purposes of this definition, "submitted"
      means any form of electronic, verbal, or written communication sent
      to the Licensor or its representatives, including but not limited to
      communication on electronic mailing lists, source code control systems,
      and issue tracking systems that are managed by, or on behalf of, the
      Licensor for the purpose of discussing and improving the Work, but
      excluding communication that is conspicuously marked or otherwise
      designated in writing by the copyright owner as "Not a Contribution."

      "Contributor" shall mean Licensor and any individual or Legal Entity
      on behalf of whom a Contribution has been received by Licensor and
      subsequently incorporated within the Work.

   2. Grant of Copyright License. Subject to the terms and conditions of
      this License, each Contributor hereby grants to You a perpetual,
      worldwide, non-exclusive, no-charge, royalty-free, irrevocable
      copyright license to reproduce, prepare Derivative Works of,
      publicly display, publicly perform, sublicense, and distribute the
      Work and such Derivative Works in Source or Object form.

   3. Grant of Patent License. Subject to the terms and conditions of
      this License, each Contributor hereby grants to You a perpetual,
      worldwide, non-exclusive, no-charge, royalty-free, irrevocable
      (except as stated in this section) patent license to make, have made,
      use, offer to sell, sell, import, and otherwise transfer the Work,
      where such license applies only to those patent claims licensable
      by such Contributor that are necessarily infringed by their
      Contribution(s) alone or by combination of their Contribution(s)
      with the Work to which such Contribution(s) was submitted. If You
      institute patent litigation against any entity (including a
      cross-claim or counterclaim in a lawsuit) alleging that the Work
      or a Contribution incorporated within the Work constitutes direct
      or contributory patent infringement, then any patent licenses
      granted to You under this License for that Work shall terminate
      as of the date such litigation is filed.

   4. Redistribution. You may reproduce and distribute copies of the
      Work or Derivative Works thereof in any medium, with or without
      modifications, and in Source or Object form, provided that You
      meet the following conditions:

      (a) You must give any other recipients of the Work or
          Derivative Works a copy of this License; and

      (b) You must cause any modified files to carry prominent notices
          stating that You changed the files; and

      (c) You must retain, in the Source form of any Derivative Works
          that You distribute, all copyright, patent, trademark, and
          attribution notices from the Source form of the Work,
          excluding those notices that do not pertain to any part of
          the Derivative Works; and

      (d) If the Work includes a "NOTICE" text file as part of its
          distribution, then any Derivative Works that You distribute must
          include a readable copy of the attribution notices contained
          within such NOTICE file, excluding those notices that do not
          pertain to any part of the Derivative Works, in at least one
          of the following places: within a NOTICE text file distributed
          as part of the Derivative Works; within the Source form or
          documentation, if provided along with the Derivative Works; or,
          within a display generated by the Derivative Works, if and
          wherever such third-party notices normally appear. The contents
          of the NOTICE file are for informational purposes only and
          do not modify the License. You may add Your own attribution
          notices within Derivative Works that You distribute, alongside
          or as an addendum to the NOTICE text from the Work, provided
          that such additional attribution notices cannot be construed
          as modifying the License.

      You may add Your own copyright statement to Your modifications and
      may provide additional or different license terms and conditions
      for use, reproduction, or distribution of Your modifications, or
      for any such Derivative Works as a whole, provided Your use,
      reproduction, and distribution of the Work otherwise complies with
      the conditions stated in this License.

   5. Submission of Contributions. Unless You explicitly state otherwise,
      any Contribution intentionally submitted for inclusion in the Work
      by You to the Licensor shall be under the terms and conditions of
      this License, without any additional terms or conditions.
      Notwithstanding the above, nothing herein shall supersede or modify
      the terms of any separate license agreement you may have executed
      with Licensor regarding such Contributions.

   6. Trademarks. This License does not grant permission to use the trade
      names, trademarks, service marks, or product names of the Licensor,
      except as required for reasonable and customary use in describing the
      origin of the Work and reproducing the content of the NOTICE file.

   7. Disclaimer of Warranty. Unless required by applicable law or
      agreed to in writing, Licensor provides the Work (and each
      Contributor provides its Contributions) on an "AS IS" BASIS,
      WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or
      implied, including, without limitation, any warranties or conditions
      of TITLE, NON-INFRINGEMENT, MERCHANTABILITY, or FITNESS FOR A
      PARTICULAR PURPOSE. You are solely responsible for determining the
      appropriateness of using or redistributing the Work and assume any
      risks associated with Your exercise of permissions under this License.

   8. Limitation of Liability. In no event and under no legal theory,
      whether in tort (including negligence), contract, or otherwise,
      unless required by applicable law (such as deliberate and grossly
      negligent acts) or agreed to in writing, shall any Contributor be
      liable to You for damages, including any direct, indirect, special,
      incidental, or consequential damages of any character arising as a
      result of this License or out of the use or inability to use the
      Work (including but not limited to damages for loss of goodwill,
      work stoppage, computer failure or malfunction, or any and all
      other commercial damages or losses), even if such Contributor
      has been advised of the possibility of such damages.

   9. Accepting Warranty or Additional Liability. While redistributing
      the Work or Derivative Works thereof, You may choose to offer,
      and charge a fee for, acceptance of support, warranty, indemnity,
      or other liability obligations and/or rights consistent with this
      License. However, in accepting such obligations, You may act only
      on Your own behalf and on Your sole responsibility, not on behalf
      of any other Contributor, and only if You agree to indemnify,
      defend, and hold each Contributor harmless for any liability
      incurred by, or claims asserted against, such Contributor by reason
      of your accepting any such warranty or additional liability.

   END OF TERMS AND CONDITIONS

   APPENDIX: How to apply the Apache License to your work.

      To apply the Apache License to your work, attach the following
      boilerplate notice, with the fields enclosed by brackets "{}"
      replaced with your own identifying information. (Don't include
      the brackets!)  The text should be enclosed in the appropriate
      comment syntax for the file format. We also recommend that a
      file or class name and description of purpose be included on the
      same "printed page" as the copyright notice for easier
      identification within third-party archives.

   Copyright contributors

   Licensed under the Apache License, Version 2.0 (the "License");
   you may not use this file except in compliance with the License.
   You may obtain a copy of the License at

       http://www.apache.org/licenses/LICENSE-2.0

   Unless required by applicable law or agreed to in writing, software
   distributed under the License is distributed on an "AS IS" BASIS,
   WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied.
   See the License for the specific language governing permissions and
   limitations under the License.
*/
(()=>{var tx=Object.defineProperty;var ex=(i,t)=>{for(var e in t)tx(i,e,{get:t[e],enumerable:!0})};var nx={u8:Uint8Array,f32:Float32Array,f64:Float64Array,u32:Uint32Array,u16:Uint16Array};function Vn(i){if(i==null||Array.isArray(i))return i;for(let[t,e]of Object.entries(nx))if(t in i){let n=atob(i[t]),s=new Uint8Array(n.length);for(let r=0;r<n.length;r++)s[r]=n.charCodeAt(r);return new e(s.buffer)}return null}function Pl(i){let t=Vn(i),{low:e,step:n}=i;return{codes:t,low:e,high:e+65534*n,at:s=>t[s]===65535?NaN:e+n*t[s]}}function Sp(i){return JSON.parse(document.getElementById(i).textContent)}var Ot=Sp("data"),Ru=Sp("frames"),os=Ot.frames?.length??0;function bp(i,t){for(let e of Object.keys(Ot))delete Ot[e];Object.assign(Ot,i),Ru=t,os=Ot.frames?.length??0}var eo=new Map,no=new Map,ix=24;window.catseyeFrame=(i,t)=>{for(eo.set(i,t);eo.size>ix;)eo.delete(eo.keys().next().value);no.get(i)?.resolve(t),no.delete(i)};function Mp(i){if(i<Ru.length)return Promise.resolve(Ru[i]);if(eo.has(i))return Promise.resolve(eo.get(i));if(no.has(i))return no.get(i).promise;let t={};t.promise=new Promise((n,s)=>Object.assign(t,{resolve:n,reject:s})),no.set(i,t);let e=document.createElement("script");return e.src=`${encodeURIComponent(Ot.beside)}/${String(i).padStart(6,"0")}.js`,e.onerror=()=>{no.delete(i),t.reject(new Error(`Frame ${Ot.frames[i].index} is not there: the folder ${Ot.beside} has to lie beside this page.`))},e.onload=()=>e.remove(),document.head.append(e),t.promise}function Ln(i,t){return Vn(i?.[t])??[]}function wp(i){let t=i&&Object.keys(i)[0];return t?Ln(i,t).length:0}var Tp=[["_rad_per_s","rad/s"],["_mps","m/s"],["_deg","\xB0"],["_dbsm","dBsm"],["_dbm","dBm"],["_db","dB"],["_ghz","GHz"],["_hz","Hz"],["_m","m"],["_s","s"]];function Oi(i){return Tp.find(([t])=>i.endsWith(t))?.[1]??""}function $s(i){let t=Tp.find(([e])=>i.endsWith(e))?.[0]??"";return i.slice(0,i.length-t.length).replaceAll("_"," ")}function F(i,t={},...e){let n=document.createElement(i);for(let[s,r]of Object.entries(t))r==null||r===!1||(s.startsWith("on")?n.addEventListener(s.slice(2),r):s in n&&s!=="list"?n[s]=r:s==="class"?n.className=r:n.setAttribute(s,r));return n.append(...e.flat().filter(s=>s!=null&&s!==!1).map(s=>s instanceof Node?s:String(s))),n}function fn(i,t,e,n){let s=F("select",{"aria-label":i,title:i,onchange:()=>n(s.value)},t.map(([r,o])=>F("option",{value:r,selected:r===e},o)));return F("label",{class:"menu"},F("span",{},i),s)}function jt(i,t=2){return i==null||!Number.isFinite(i)?"\u2013":i.toFixed(t).replace("-","\u2212")}function xr(i){let t=F("canvas"),e=()=>{let{clientWidth:n,clientHeight:s}=t;if(!n||!s)return;let r=window.devicePixelRatio||1;(t.width!==Math.round(n*r)||t.height!==Math.round(s*r))&&(t.width=Math.round(n*r),t.height=Math.round(s*r));let o=t.getContext("2d");o.setTransform(r,0,0,r,0,0),o.clearRect(0,0,n,s),i(o,n,s)};return new ResizeObserver(e).observe(t),{canvas:t,redraw:e}}function Zn(i){return getComputedStyle(document.documentElement).getPropertyValue(`--${i}`).trim()}function io(i,t,e){let n=Math.abs(t-i)||1,s=n/Math.max(1,e),r=10**Math.floor(Math.log10(s)),o=[1,2,5,10].map(l=>l*r).find(l=>l>=s),a=[];for(let l=Math.ceil(Math.min(i,t)/o);l*o<=Math.max(i,t)+1e-9*n;l++)a.push(l*o);return{list:a,digits:Math.max(0,-Math.floor(Math.log10(o)+1e-9))}}var or={LEFT:0,MIDDLE:1,RIGHT:2,ROTATE:0,DOLLY:1,PAN:2},ar={ROTATE:0,PAN:1,DOLLY_PAN:2,DOLLY_ROTATE:3},am=0,ld=1,lm=2;var Wa=1,cm=2,Fo=3,lr=0,ni=1,ri=2,Ar=0,Bo=1,cd=2,hd=3,ud=4,hm=5;var Er=100,um=101,dm=102,fm=103,pm=104,mm=200,gm=201,_m=202,xm=203,dd=204,fd=205,ym=206,vm=207,Sm=208,bm=209,Mm=210,wm=211,Tm=212,Am=213,Em=214,lc=0,cc=1,hc=2,bo=3,uc=4,dc=5,fc=6,pc=7,Vc=0,Cm=1,Rm=2,us=0,pd=1,md=2,gd=3,_d=4,xd=5,yd=6,vd=7;var Sd=300,Cr=301,ko=302,Gc=303,Hc=304,mc=1e3,ls=1001,gc=1002,mn=1003,Im=1004;var Xa=1005;var ti=1006,Wc=1007;var Us=1008;var oi=1009,bd=1010,Md=1011,zo=1012,Xc=1013,Gi=1014,Hi=1015,Wi=1016,qc=1017,Yc=1018,Rr=1020,wd=35902,Td=35899,Ad=1021,Ed=1022,Xi=1023,Is=1026,Os=1027,Cd=1028,$c=1029,cr=1030,Kc=1031;var Zc=1033,qa=33776,Ya=33777,$a=33778,Ka=33779,Jc=35840,jc=35841,Qc=35842,th=35843,eh=36196,nh=37492,ih=37496,sh=37488,rh=37489,Za=37490,oh=37491,ah=37808,lh=37809,ch=37810,hh=37811,uh=37812,dh=37813,fh=37814,ph=37815,mh=37816,gh=37817,_h=37818,xh=37819,yh=37820,vh=37821,Sh=36492,bh=36494,Mh=36495,wh=36283,Th=36284,Ja=36285,Ah=36286;var Sa=2300,_c=2301,oc=2302,Qu=2303,td=2400,ed=2401,nd=2402;var Pm=3200;var Eh=0,Lm=1,Fs="",jn="srgb",ba="srgb-linear",Ma="linear",Re="srgb";var ac=7680;var Dm=519,Nm=512,Um=513,Om=514,Rd=515,Fm=516,Bm=517,Id=518,Pd=519,Ld=35044;var Dd="300 es",Ei=2e3,Mo=2001;function sx(i){for(let t=i.length-1;t>=0;--t)if(i[t]>=65535)return!0;return!1}function rx(i){return ArrayBuffer.isView(i)&&!(i instanceof DataView)}function wa(i){return document.createElementNS("http://www.w3.org/1999/xhtml",i)}function km(){let i=wa("canvas");return i.style.display="block",i}var Ap={},wo=null;function Ta(...i){let t="THREE."+i.shift();wo?wo("log",t,...i):console.log(t,...i)}function zm(i){let t=i[0];if(typeof t=="string"&&t.startsWith("TSL:")){let e=i[1];e&&e.isStackTrace?i[0]+=" "+e.getLocation():i[1]='Stack trace not available. Enable "THREE.Node.captureStackTrace" to capture stack traces.'}return i}function $t(...i){i=zm(i);let t="THREE."+i.shift();if(wo)wo("warn",t,...i);else{let e=i[0];e&&e.isStackTrace?console.warn(e.getError(t)):console.warn(t,...i)}}function ee(...i){i=zm(i);let t="THREE."+i.shift();if(wo)wo("error",t,...i);else{let e=i[0];e&&e.isStackTrace?console.error(e.getError(t)):console.error(t,...i)}}function ya(...i){let t=i.join(" ");t in Ap||(Ap[t]=!0,$t(...i))}function Vm(i,t,e){return new Promise(function(n,s){function r(){switch(i.clientWaitSync(t,i.SYNC_FLUSH_COMMANDS_BIT,0)){case i.WAIT_FAILED:s();break;case i.TIMEOUT_EXPIRED:setTimeout(r,e);break;default:n()}}setTimeout(r,e)})}var Gm={[lc]:lc,[hc]:fc,[uc]:uc,[bo]:dc,[cc]:cc,[fc]:hc,[pc]:pc,[dc]:bo},zi=class{addEventListener(t,e){this._listeners===void 0&&(this._listeners={});let n=this._listeners;n[t]===void 0&&(n[t]=[]),n[t].indexOf(e)===-1&&n[t].push(e)}hasEventListener(t,e){let n=this._listeners;return n===void 0?!1:n[t]!==void 0&&n[t].indexOf(e)!==-1}removeEventListener(t,e){let n=this._listeners;if(n===void 0)return;let s=n[t];if(s!==void 0){let r=s.indexOf(e);r!==-1&&s.splice(r,1)}}dispatchEvent(t){let e=this._listeners;if(e===void 0)return;let n=e[t.type];if(n!==void 0){t.target=this;let s=n.slice(0);for(let r=0,o=s.length;r<o;r++)s[r].call(this,t);t.target=null}}},Gn=["00","01","02","03","04","05","06","07","08","09","0a","0b","0c","0d","0e","0f","10","11","12","13","14","15","16","17","18","19","1a","1b","1c","1d","1e","1f","20","21","22","23","24","25","26","27","28","29","2a","2b","2c","2d","2e","2f","30","31","32","33","34","35","36","37","38","39","3a","3b","3c","3d","3e","3f","40","41","42","43","44","45","46","47","48","49","4a","4b","4c","4d","4e","4f","50","51","52","53","54","55","56","57","58","59","5a","5b","5c","5d","5e","5f","60","61","62","63","64","65","66","67","68","69","6a","6b","6c","6d","6e","6f","70","71","72","73","74","75","76","77","78","79","7a","7b","7c","7d","7e","7f","80","81","82","83","84","85","86","87","88","89","8a","8b","8c","8d","8e","8f","90","91","92","93","94","95","96","97","98","99","9a","9b","9c","9d","9e","9f","a0","a1","a2","a3","a4","a5","a6","a7","a8","a9","aa","ab","ac","ad","ae","af","b0","b1","b2","b3","b4","b5","b6","b7","b8","b9","ba","bb","bc","bd","be","bf","c0","c1","c2","c3","c4","c5","c6","c7","c8","c9","ca","cb","cc","cd","ce","cf","d0","d1","d2","d3","d4","d5","d6","d7","d8","d9","da","db","dc","dd","de","df","e0","e1","e2","e3","e4","e5","e6","e7","e8","e9","ea","eb","ec","ed","ee","ef","f0","f1","f2","f3","f4","f5","f6","f7","f8","f9","fa","fb","fc","fd","fe","ff"],Ep=1234567,vo=Math.PI/180,To=180/Math.PI;function hr(){let i=Math.random()*4294967295|0,t=Math.random()*4294967295|0,e=Math.random()*4294967295|0,n=Math.random()*4294967295|0;return(Gn[i&255]+Gn[i>>8&255]+Gn[i>>16&255]+Gn[i>>24&255]+"-"+Gn[t&255]+Gn[t>>8&255]+"-"+Gn[t>>16&15|64]+Gn[t>>24&255]+"-"+Gn[e&63|128]+Gn[e>>8&255]+"-"+Gn[e>>16&255]+Gn[e>>24&255]+Gn[n&255]+Gn[n>>8&255]+Gn[n>>16&255]+Gn[n>>24&255]).toLowerCase()}function le(i,t,e){return Math.max(t,Math.min(e,i))}function Nd(i,t){return(i%t+t)%t}function ox(i,t,e,n,s){return n+(i-t)*(s-n)/(e-t)}function ax(i,t,e){return i!==t?(e-i)/(t-i):0}function va(i,t,e){return(1-e)*i+e*t}function lx(i,t,e,n){return va(i,t,1-Math.exp(-e*n))}function cx(i,t=1){return t-Math.abs(Nd(i,t*2)-t)}function hx(i,t,e){return i<=t?0:i>=e?1:(i=(i-t)/(e-t),i*i*(3-2*i))}function ux(i,t,e){return i<=t?0:i>=e?1:(i=(i-t)/(e-t),i*i*i*(i*(i*6-15)+10))}function dx(i,t){return i+Math.floor(Math.random()*(t-i+1))}function fx(i,t){return i+Math.random()*(t-i)}function px(i){return i*(.5-Math.random())}function mx(i){i!==void 0&&(Ep=i);let t=Ep+=1831565813;return t=Math.imul(t^t>>>15,t|1),t^=t+Math.imul(t^t>>>7,t|61),((t^t>>>14)>>>0)/4294967296}function gx(i){return i*vo}function _x(i){return i*To}function xx(i){return i>0&&Number.isInteger(i)&&2**Math.round(Math.log2(i))===i}function yx(i){return Math.pow(2,Math.ceil(Math.log(i)/Math.LN2))}function Ud(i){return Math.pow(2,Math.floor(Math.log(i)/Math.LN2))}function vx(i,t,e,n,s){let r=Math.cos,o=Math.sin,a=r(e/2),l=o(e/2),c=r((t+n)/2),u=o((t+n)/2),h=r((t-n)/2),d=o((t-n)/2),f=r((n-t)/2),m=o((n-t)/2);switch(s){case"XYX":i.set(a*u,l*h,l*d,a*c);break;case"YZY":i.set(l*d,a*u,l*h,a*c);break;case"ZXZ":i.set(l*h,l*d,a*u,a*c);break;case"XZX":i.set(a*u,l*m,l*f,a*c);break;case"YXY":i.set(l*f,a*u,l*m,a*c);break;case"ZYZ":i.set(l*m,l*f,a*u,a*c);break;default:$t("MathUtils: .setQuaternionFromProperEuler() encountered an unknown order: "+s)}}function Ch(i){switch(i.constructor){case Uint32Array:return 4294967295;case Uint16Array:return 65535;case Uint8Array:case Uint8ClampedArray:return 255;case Int32Array:return 2147483647;case Int16Array:return 32767;case Int8Array:return 127;default:return}}function Od(i,t){if(t.constructor===Float32Array)return i;let e=Ch(t);if(e===void 0)throw new Error("THREE.MathUtils: Invalid component type.");return Math.max(i/e,-1)}function Fd(i,t){if(t.constructor===Float32Array)return i;let e=Ch(t);if(e===void 0)throw new Error("THREE.MathUtils: Invalid component type.");return Math.round(i*e)}var ja={DEG2RAD:vo,RAD2DEG:To,generateUUID:hr,clamp:le,euclideanModulo:Nd,mapLinear:ox,inverseLerp:ax,lerp:va,damp:lx,pingpong:cx,smoothstep:hx,smootherstep:ux,randInt:dx,randFloat:fx,randFloatSpread:px,seededRandom:mx,degToRad:gx,radToDeg:_x,isPowerOfTwo:xx,ceilPowerOfTwo:yx,floorPowerOfTwo:Ud,setQuaternionFromProperEuler:vx,normalize:Fd,denormalize:Od},Zt=class{static{this.prototype.isVector2=!0}constructor(t=0,e=0){this.x=t,this.y=e}get width(){return this.x}set width(t){this.x=t}get height(){return this.y}set height(t){this.y=t}set(t,e){return this.x=t,this.y=e,this}setScalar(t){return this.x=t,this.y=t,this}setX(t){return this.x=t,this}setY(t){return this.y=t,this}setComponent(t,e){switch(t){case 0:this.x=e;break;case 1:this.y=e;break;default:throw new Error("THREE.Vector2: index is out of range: "+t)}return this}getComponent(t){switch(t){case 0:return this.x;case 1:return this.y;default:throw new Error("THREE.Vector2: index is out of range: "+t)}}clone(){return new this.constructor(this.x,this.y)}copy(t){return this.x=t.x,this.y=t.y,this}add(t){return this.x+=t.x,this.y+=t.y,this}addScalar(t){return this.x+=t,this.y+=t,this}addVectors(t,e){return this.x=t.x+e.x,this.y=t.y+e.y,this}addScaledVector(t,e){return this.x+=t.x*e,this.y+=t.y*e,this}sub(t){return this.x-=t.x,this.y-=t.y,this}subScalar(t){return this.x-=t,this.y-=t,this}subVectors(t,e){return this.x=t.x-e.x,this.y=t.y-e.y,this}multiply(t){return this.x*=t.x,this.y*=t.y,this}multiplyScalar(t){return this.x*=t,this.y*=t,this}divide(t){return this.x/=t.x,this.y/=t.y,this}divideScalar(t){return this.multiplyScalar(1/t)}applyMatrix3(t){let e=this.x,n=this.y,s=t.elements;return this.x=s[0]*e+s[3]*n+s[6],this.y=s[1]*e+s[4]*n+s[7],this}min(t){return this.x=Math.min(this.x,t.x),this.y=Math.min(this.y,t.y),this}max(t){return this.x=Math.max(this.x,t.x),this.y=Math.max(this.y,t.y),this}clamp(t,e){return this.x=le(this.x,t.x,e.x),this.y=le(this.y,t.y,e.y),this}clampScalar(t,e){return this.x=le(this.x,t,e),this.y=le(this.y,t,e),this}clampLength(t,e){let n=this.length();return this.divideScalar(n||1).multiplyScalar(le(n,t,e))}floor(){return this.x=Math.floor(this.x),this.y=Math.floor(this.y),this}ceil(){return this.x=Math.ceil(this.x),this.y=Math.ceil(this.y),this}round(){return this.x=Math.round(this.x),this.y=Math.round(this.y),this}roundToZero(){return this.x=Math.trunc(this.x),this.y=Math.trunc(this.y),this}negate(){return this.x=-this.x,this.y=-this.y,this}dot(t){return this.x*t.x+this.y*t.y}cross(t){return this.x*t.y-this.y*t.x}lengthSq(){return this.x*this.x+this.y*this.y}length(){return Math.sqrt(this.x*this.x+this.y*this.y)}manhattanLength(){return Math.abs(this.x)+Math.abs(this.y)}normalize(){return this.divideScalar(this.length()||1)}angle(){return Math.atan2(-this.y,-this.x)+Math.PI}angleTo(t){let e=Math.sqrt(this.lengthSq()*t.lengthSq());if(e===0)return Math.PI/2;let n=this.dot(t)/e;return Math.acos(le(n,-1,1))}distanceTo(t){return Math.sqrt(this.distanceToSquared(t))}distanceToSquared(t){let e=this.x-t.x,n=this.y-t.y;return e*e+n*n}manhattanDistanceTo(t){return Math.abs(this.x-t.x)+Math.abs(this.y-t.y)}setLength(t){return this.normalize().multiplyScalar(t)}lerp(t,e){return this.x+=(t.x-this.x)*e,this.y+=(t.y-this.y)*e,this}lerpVectors(t,e,n){return this.x=t.x+(e.x-t.x)*n,this.y=t.y+(e.y-t.y)*n,this}equals(t){return t.x===this.x&&t.y===this.y}fromArray(t,e=0){return this.x=t[e],this.y=t[e+1],this}toArray(t=[],e=0){return t[e]=this.x,t[e+1]=this.y,t}fromBufferAttribute(t,e){return this.x=t.getX(e),this.y=t.getY(e),this}rotateAround(t,e){let n=Math.cos(e),s=Math.sin(e),r=this.x-t.x,o=this.y-t.y;return this.x=r*n-o*s+t.x,this.y=r*s+o*n+t.y,this}random(){return this.x=Math.random(),this.y=Math.random(),this}*[Symbol.iterator](){yield this.x,yield this.y}},Je=class{constructor(t=0,e=0,n=0,s=1){this.isQuaternion=!0,this._x=t,this._y=e,this._z=n,this._w=s}static slerpFlat(t,e,n,s,r,o,a){let l=n[s+0],c=n[s+1],u=n[s+2],h=n[s+3],d=r[o+0],f=r[o+1],m=r[o+2],y=r[o+3];if(h!==y||l!==d||c!==f||u!==m){let p=l*d+c*f+u*m+h*y;p<0&&(d=-d,f=-f,m=-m,y=-y,p=-p);let g=1-a;if(p<.9995){let v=Math.acos(p),E=Math.sin(v);g=Math.sin(g*v)/E,a=Math.sin(a*v)/E,l=l*g+d*a,c=c*g+f*a,u=u*g+m*a,h=h*g+y*a}else{l=l*g+d*a,c=c*g+f*a,u=u*g+m*a,h=h*g+y*a;let v=1/Math.sqrt(l*l+c*c+u*u+h*h);l*=v,c*=v,u*=v,h*=v}}t[e]=l,t[e+1]=c,t[e+2]=u,t[e+3]=h}static multiplyQuaternionsFlat(t,e,n,s,r,o){let a=n[s],l=n[s+1],c=n[s+2],u=n[s+3],h=r[o],d=r[o+1],f=r[o+2],m=r[o+3];return t[e]=a*m+u*h+l*f-c*d,t[e+1]=l*m+u*d+c*h-a*f,t[e+2]=c*m+u*f+a*d-l*h,t[e+3]=u*m-a*h-l*d-c*f,t}get x(){return this._x}set x(t){this._x=t,this._onChangeCallback()}get y(){return this._y}set y(t){this._y=t,this._onChangeCallback()}get z(){return this._z}set z(t){this._z=t,this._onChangeCallback()}get w(){return this._w}set w(t){this._w=t,this._onChangeCallback()}set(t,e,n,s){return this._x=t,this._y=e,this._z=n,this._w=s,this._onChangeCallback(),this}clone(){return new this.constructor(this._x,this._y,this._z,this._w)}copy(t){return this._x=t.x,this._y=t.y,this._z=t.z,this._w=t.w,this._onChangeCallback(),this}setFromEuler(t,e=!0){let n=t._x,s=t._y,r=t._z,o=t._order,a=Math.cos,l=Math.sin,c=a(n/2),u=a(s/2),h=a(r/2),d=l(n/2),f=l(s/2),m=l(r/2);switch(o){case"XYZ":this._x=d*u*h+c*f*m,this._y=c*f*h-d*u*m,this._z=c*u*m+d*f*h,this._w=c*u*h-d*f*m;break;case"YXZ":this._x=d*u*h+c*f*m,this._y=c*f*h-d*u*m,this._z=c*u*m-d*f*h,this._w=c*u*h+d*f*m;break;case"ZXY":this._x=d*u*h-c*f*m,this._y=c*f*h+d*u*m,this._z=c*u*m+d*f*h,this._w=c*u*h-d*f*m;break;case"ZYX":this._x=d*u*h-c*f*m,this._y=c*f*h+d*u*m,this._z=c*u*m-d*f*h,this._w=c*u*h+d*f*m;break;case"YZX":this._x=d*u*h+c*f*m,this._y=c*f*h+d*u*m,this._z=c*u*m-d*f*h,this._w=c*u*h-d*f*m;break;case"XZY":this._x=d*u*h-c*f*m,this._y=c*f*h-d*u*m,this._z=c*u*m+d*f*h,this._w=c*u*h+d*f*m;break;default:$t("Quaternion: .setFromEuler() encountered an unknown order: "+o)}return e===!0&&this._onChangeCallback(),this}setFromAxisAngle(t,e){let n=e/2,s=Math.sin(n);return this._x=t.x*s,this._y=t.y*s,this._z=t.z*s,this._w=Math.cos(n),this._onChangeCallback(),this}setFromRotationMatrix(t){let e=t.elements,n=e[0],s=e[4],r=e[8],o=e[1],a=e[5],l=e[9],c=e[2],u=e[6],h=e[10],d=n+a+h;if(d>0){let f=.5/Math.sqrt(d+1);this._w=.25/f,this._x=(u-l)*f,this._y=(r-c)*f,this._z=(o-s)*f}else if(n>a&&n>h){let f=2*Math.sqrt(1+n-a-h);this._w=(u-l)/f,this._x=.25*f,this._y=(s+o)/f,this._z=(r+c)/f}else if(a>h){let f=2*Math.sqrt(1+a-n-h);this._w=(r-c)/f,this._x=(s+o)/f,this._y=.25*f,this._z=(l+u)/f}else{let f=2*Math.sqrt(1+h-n-a);this._w=(o-s)/f,this._x=(r+c)/f,this._y=(l+u)/f,this._z=.25*f}return this._onChangeCallback(),this}setFromUnitVectors(t,e){let n=t.dot(e)+1;return n<1e-8?(n=0,Math.abs(t.x)>Math.abs(t.z)?(this._x=-t.y,this._y=t.x,this._z=0,this._w=n):(this._x=0,this._y=-t.z,this._z=t.y,this._w=n)):(this._x=t.y*e.z-t.z*e.y,this._y=t.z*e.x-t.x*e.z,this._z=t.x*e.y-t.y*e.x,this._w=n),this.normalize()}angleTo(t){return 2*Math.acos(Math.abs(le(this.dot(t),-1,1)))}rotateTowards(t,e){let n=this.angleTo(t);if(n===0)return this;let s=Math.min(1,e/n);return this.slerp(t,s),this}identity(){return this.set(0,0,0,1)}invert(){return this.conjugate()}conjugate(){return this._x*=-1,this._y*=-1,this._z*=-1,this._onChangeCallback(),this}dot(t){return this._x*t._x+this._y*t._y+this._z*t._z+this._w*t._w}lengthSq(){return this._x*this._x+this._y*this._y+this._z*this._z+this._w*this._w}length(){return Math.sqrt(this._x*this._x+this._y*this._y+this._z*this._z+this._w*this._w)}normalize(){let t=this.length();return t===0?(this._x=0,this._y=0,this._z=0,this._w=1):(t=1/t,this._x=this._x*t,this._y=this._y*t,this._z=this._z*t,this._w=this._w*t),this._onChangeCallback(),this}multiply(t){return this.multiplyQuaternions(this,t)}premultiply(t){return this.multiplyQuaternions(t,this)}multiplyQuaternions(t,e){let n=t._x,s=t._y,r=t._z,o=t._w,a=e._x,l=e._y,c=e._z,u=e._w;return this._x=n*u+o*a+s*c-r*l,this._y=s*u+o*l+r*a-n*c,this._z=r*u+o*c+n*l-s*a,this._w=o*u-n*a-s*l-r*c,this._onChangeCallback(),this}slerp(t,e){let n=t._x,s=t._y,r=t._z,o=t._w,a=this.dot(t);a<0&&(n=-n,s=-s,r=-r,o=-o,a=-a);let l=1-e;if(a<.9995){let c=Math.acos(a),u=Math.sin(c);l=Math.sin(l*c)/u,e=Math.sin(e*c)/u,this._x=this._x*l+n*e,this._y=this._y*l+s*e,this._z=this._z*l+r*e,this._w=this._w*l+o*e,this._onChangeCallback()}else this._x=this._x*l+n*e,this._y=this._y*l+s*e,this._z=this._z*l+r*e,this._w=this._w*l+o*e,this.normalize();return this}slerpQuaternions(t,e,n){return this.copy(t).slerp(e,n)}random(){let t=2*Math.PI*Math.random(),e=2*Math.PI*Math.random(),n=Math.random(),s=Math.sqrt(1-n),r=Math.sqrt(n);return this.set(s*Math.sin(t),s*Math.cos(t),r*Math.sin(e),r*Math.cos(e))}equals(t){return t._x===this._x&&t._y===this._y&&t._z===this._z&&t._w===this._w}fromArray(t,e=0){return this._x=t[e],this._y=t[e+1],this._z=t[e+2],this._w=t[e+3],this._onChangeCallback(),this}toArray(t=[],e=0){return t[e]=this._x,t[e+1]=this._y,t[e+2]=this._z,t[e+3]=this._w,t}fromBufferAttribute(t,e){return this._x=t.getX(e),this._y=t.getY(e),this._z=t.getZ(e),this._w=t.getW(e),this._onChangeCallback(),this}toJSON(){return this.toArray()}_onChange(t){return this._onChangeCallback=t,this}_onChangeCallback(){}*[Symbol.iterator](){yield this._x,yield this._y,yield this._z,yield this._w}},k=class{static{this.prototype.isVector3=!0}constructor(t=0,e=0,n=0){this.x=t,this.y=e,this.z=n}set(t,e,n){return n===void 0&&(n=this.z),this.x=t,this.y=e,this.z=n,this}setScalar(t){return this.x=t,this.y=t,this.z=t,this}setX(t){return this.x=t,this}setY(t){return this.y=t,this}setZ(t){return this.z=t,this}setComponent(t,e){switch(t){case 0:this.x=e;break;case 1:this.y=e;break;case 2:this.z=e;break;default:throw new Error("THREE.Vector3: index is out of range: "+t)}return this}getComponent(t){switch(t){case 0:return this.x;case 1:return this.y;case 2:return this.z;default:throw new Error("THREE.Vector3: index is out of range: "+t)}}clone(){return new this.constructor(this.x,this.y,this.z)}copy(t){return this.x=t.x,this.y=t.y,this.z=t.z,this}add(t){return this.x+=t.x,this.y+=t.y,this.z+=t.z,this}addScalar(t){return this.x+=t,this.y+=t,this.z+=t,this}addVectors(t,e){return this.x=t.x+e.x,this.y=t.y+e.y,this.z=t.z+e.z,this}addScaledVector(t,e){return this.x+=t.x*e,this.y+=t.y*e,this.z+=t.z*e,this}sub(t){return this.x-=t.x,this.y-=t.y,this.z-=t.z,this}subScalar(t){return this.x-=t,this.y-=t,this.z-=t,this}subVectors(t,e){return this.x=t.x-e.x,this.y=t.y-e.y,this.z=t.z-e.z,this}multiply(t){return this.x*=t.x,this.y*=t.y,this.z*=t.z,this}multiplyScalar(t){return this.x*=t,this.y*=t,this.z*=t,this}multiplyVectors(t,e){return this.x=t.x*e.x,this.y=t.y*e.y,this.z=t.z*e.z,this}applyEuler(t){return this.applyQuaternion(Cp.setFromEuler(t))}applyAxisAngle(t,e){return this.applyQuaternion(Cp.setFromAxisAngle(t,e))}applyMatrix3(t){let e=this.x,n=this.y,s=this.z,r=t.elements;return this.x=r[0]*e+r[3]*n+r[6]*s,this.y=r[1]*e+r[4]*n+r[7]*s,this.z=r[2]*e+r[5]*n+r[8]*s,this}applyNormalMatrix(t){return this.applyMatrix3(t).normalize()}applyMatrix4(t){let e=this.x,n=this.y,s=this.z,r=t.elements,o=1/(r[3]*e+r[7]*n+r[11]*s+r[15]);return this.x=(r[0]*e+r[4]*n+r[8]*s+r[12])*o,this.y=(r[1]*e+r[5]*n+r[9]*s+r[13])*o,this.z=(r[2]*e+r[6]*n+r[10]*s+r[14])*o,this}applyQuaternion(t){let e=this.x,n=this.y,s=this.z,r=t.x,o=t.y,a=t.z,l=t.w,c=2*(o*s-a*n),u=2*(a*e-r*s),h=2*(r*n-o*e);return this.x=e+l*c+o*h-a*u,this.y=n+l*u+a*c-r*h,this.z=s+l*h+r*u-o*c,this}project(t){return this.applyMatrix4(t.matrixWorldInverse).applyMatrix4(t.projectionMatrix)}unproject(t){return this.applyMatrix4(t.projectionMatrixInverse).applyMatrix4(t.matrixWorld)}transformDirection(t){let e=this.x,n=this.y,s=this.z,r=t.elements;return this.x=r[0]*e+r[4]*n+r[8]*s,this.y=r[1]*e+r[5]*n+r[9]*s,this.z=r[2]*e+r[6]*n+r[10]*s,this.normalize()}divide(t){return this.x/=t.x,this.y/=t.y,this.z/=t.z,this}divideScalar(t){return this.multiplyScalar(1/t)}min(t){return this.x=Math.min(this.x,t.x),this.y=Math.min(this.y,t.y),this.z=Math.min(this.z,t.z),this}max(t){return this.x=Math.max(this.x,t.x),this.y=Math.max(this.y,t.y),this.z=Math.max(this.z,t.z),this}clamp(t,e){return this.x=le(this.x,t.x,e.x),this.y=le(this.y,t.y,e.y),this.z=le(this.z,t.z,e.z),this}clampScalar(t,e){return this.x=le(this.x,t,e),this.y=le(this.y,t,e),this.z=le(this.z,t,e),this}clampLength(t,e){let n=this.length();return this.divideScalar(n||1).multiplyScalar(le(n,t,e))}floor(){return this.x=Math.floor(this.x),this.y=Math.floor(this.y),this.z=Math.floor(this.z),this}ceil(){return this.x=Math.ceil(this.x),this.y=Math.ceil(this.y),this.z=Math.ceil(this.z),this}round(){return this.x=Math.round(this.x),this.y=Math.round(this.y),this.z=Math.round(this.z),this}roundToZero(){return this.x=Math.trunc(this.x),this.y=Math.trunc(this.y),this.z=Math.trunc(this.z),this}negate(){return this.x=-this.x,this.y=-this.y,this.z=-this.z,this}dot(t){return this.x*t.x+this.y*t.y+this.z*t.z}lengthSq(){return this.x*this.x+this.y*this.y+this.z*this.z}length(){return Math.sqrt(this.x*this.x+this.y*this.y+this.z*this.z)}manhattanLength(){return Math.abs(this.x)+Math.abs(this.y)+Math.abs(this.z)}normalize(){return this.divideScalar(this.length()||1)}setLength(t){return this.normalize().multiplyScalar(t)}lerp(t,e){return this.x+=(t.x-this.x)*e,this.y+=(t.y-this.y)*e,this.z+=(t.z-this.z)*e,this}lerpVectors(t,e,n){return this.x=t.x+(e.x-t.x)*n,this.y=t.y+(e.y-t.y)*n,this.z=t.z+(e.z-t.z)*n,this}cross(t){return this.crossVectors(this,t)}crossVectors(t,e){let n=t.x,s=t.y,r=t.z,o=e.x,a=e.y,l=e.z;return this.x=s*l-r*a,this.y=r*o-n*l,this.z=n*a-s*o,this}projectOnVector(t){let e=t.lengthSq();if(e===0)return this.set(0,0,0);let n=t.dot(this)/e;return this.copy(t).multiplyScalar(n)}projectOnPlane(t){return Iu.copy(this).projectOnVector(t),this.sub(Iu)}reflect(t){return this.sub(Iu.copy(t).multiplyScalar(2*this.dot(t)))}angleTo(t){let e=Math.sqrt(this.lengthSq()*t.lengthSq());if(e===0)return Math.PI/2;let n=this.dot(t)/e;return Math.acos(le(n,-1,1))}distanceTo(t){return Math.sqrt(this.distanceToSquared(t))}distanceToSquared(t){let e=this.x-t.x,n=this.y-t.y,s=this.z-t.z;return e*e+n*n+s*s}manhattanDistanceTo(t){return Math.abs(this.x-t.x)+Math.abs(this.y-t.y)+Math.abs(this.z-t.z)}setFromSpherical(t){return this.setFromSphericalCoords(t.radius,t.phi,t.theta)}setFromSphericalCoords(t,e,n){let s=Math.sin(e)*t;return this.x=s*Math.sin(n),this.y=Math.cos(e)*t,this.z=s*Math.cos(n),this}setFromCylindrical(t){return this.setFromCylindricalCoords(t.radius,t.theta,t.y)}setFromCylindricalCoords(t,e,n){return this.x=t*Math.sin(e),this.y=n,this.z=t*Math.cos(e),this}setFromMatrixPosition(t){let e=t.elements;return this.x=e[12],this.y=e[13],this.z=e[14],this}setFromMatrixScale(t){let e=this.setFromMatrixColumn(t,0).length(),n=this.setFromMatrixColumn(t,1).length(),s=this.setFromMatrixColumn(t,2).length();return this.x=e,this.y=n,this.z=s,this}setFromMatrixColumn(t,e){return this.fromArray(t.elements,e*4)}setFromMatrix3Column(t,e){return this.fromArray(t.elements,e*3)}setFromEuler(t){return this.x=t._x,this.y=t._y,this.z=t._z,this}setFromColor(t){return this.x=t.r,this.y=t.g,this.z=t.b,this}equals(t){return t.x===this.x&&t.y===this.y&&t.z===this.z}fromArray(t,e=0){return this.x=t[e],this.y=t[e+1],this.z=t[e+2],this}toArray(t=[],e=0){return t[e]=this.x,t[e+1]=this.y,t[e+2]=this.z,t}fromBufferAttribute(t,e){return this.x=t.getX(e),this.y=t.getY(e),this.z=t.getZ(e),this}random(){return this.x=Math.random(),this.y=Math.random(),this.z=Math.random(),this}randomDirection(){let t=Math.random()*Math.PI*2,e=Math.random()*2-1,n=Math.sqrt(1-e*e);return this.x=n*Math.cos(t),this.y=e,this.z=n*Math.sin(t),this}*[Symbol.iterator](){yield this.x,yield this.y,yield this.z}},Iu=new k,Cp=new Je,ie=class{static{this.prototype.isMatrix3=!0}constructor(t,e,n,s,r,o,a,l,c){this.elements=[1,0,0,0,1,0,0,0,1],t!==void 0&&this.set(t,e,n,s,r,o,a,l,c)}set(t,e,n,s,r,o,a,l,c){let u=this.elements;return u[0]=t,u[1]=s,u[2]=a,u[3]=e,u[4]=r,u[5]=l,u[6]=n,u[7]=o,u[8]=c,this}identity(){return this.set(1,0,0,0,1,0,0,0,1),this}copy(t){let e=this.elements,n=t.elements;return e[0]=n[0],e[1]=n[1],e[2]=n[2],e[3]=n[3],e[4]=n[4],e[5]=n[5],e[6]=n[6],e[7]=n[7],e[8]=n[8],this}extractBasis(t,e,n){return t.setFromMatrix3Column(this,0),e.setFromMatrix3Column(this,1),n.setFromMatrix3Column(this,2),this}setFromMatrix4(t){let e=t.elements;return this.set(e[0],e[4],e[8],e[1],e[5],e[9],e[2],e[6],e[10]),this}multiply(t){return this.multiplyMatrices(this,t)}premultiply(t){return this.multiplyMatrices(t,this)}multiplyMatrices(t,e){let n=t.elements,s=e.elements,r=this.elements,o=n[0],a=n[3],l=n[6],c=n[1],u=n[4],h=n[7],d=n[2],f=n[5],m=n[8],y=s[0],p=s[3],g=s[6],v=s[1],E=s[4],b=s[7],I=s[2],A=s[5],x=s[8];return r[0]=o*y+a*v+l*I,r[3]=o*p+a*E+l*A,r[6]=o*g+a*b+l*x,r[1]=c*y+u*v+h*I,r[4]=c*p+u*E+h*A,r[7]=c*g+u*b+h*x,r[2]=d*y+f*v+m*I,r[5]=d*p+f*E+m*A,r[8]=d*g+f*b+m*x,this}multiplyScalar(t){let e=this.elements;return e[0]*=t,e[3]*=t,e[6]*=t,e[1]*=t,e[4]*=t,e[7]*=t,e[2]*=t,e[5]*=t,e[8]*=t,this}determinant(){let t=this.elements,e=t[0],n=t[1],s=t[2],r=t[3],o=t[4],a=t[5],l=t[6],c=t[7],u=t[8];return e*o*u-e*a*c-n*r*u+n*a*l+s*r*c-s*o*l}invert(){let t=this.elements,e=t[0],n=t[1],s=t[2],r=t[3],o=t[4],a=t[5],l=t[6],c=t[7],u=t[8],h=u*o-a*c,d=a*l-u*r,f=c*r-o*l,m=e*h+n*d+s*f;if(m===0)return this.set(0,0,0,0,0,0,0,0,0);let y=1/m;return t[0]=h*y,t[1]=(s*c-u*n)*y,t[2]=(a*n-s*o)*y,t[3]=d*y,t[4]=(u*e-s*l)*y,t[5]=(s*r-a*e)*y,t[6]=f*y,t[7]=(n*l-c*e)*y,t[8]=(o*e-n*r)*y,this}transpose(){let t,e=this.elements;return t=e[1],e[1]=e[3],e[3]=t,t=e[2],e[2]=e[6],e[6]=t,t=e[5],e[5]=e[7],e[7]=t,this}getNormalMatrix(t){return this.setFromMatrix4(t).invert().transpose()}transposeIntoArray(t){let e=this.elements;return t[0]=e[0],t[1]=e[3],t[2]=e[6],t[3]=e[1],t[4]=e[4],t[5]=e[7],t[6]=e[2],t[7]=e[5],t[8]=e[8],this}setUvTransform(t,e,n,s,r,o,a){let l=Math.cos(r),c=Math.sin(r);return this.set(n*l,n*c,-n*(l*o+c*a)+o+t,-s*c,s*l,-s*(-c*o+l*a)+a+e,0,0,1),this}scale(t,e){return ya("Matrix3: .scale() is deprecated. Use .makeScale() instead."),this.premultiply(Pu.makeScale(t,e)),this}rotate(t){return ya("Matrix3: .rotate() is deprecated. Use .makeRotation() instead."),this.premultiply(Pu.makeRotation(-t)),this}translate(t,e){return ya("Matrix3: .translate() is deprecated. Use .makeTranslation() instead."),this.premultiply(Pu.makeTranslation(t,e)),this}makeTranslation(t,e){return t.isVector2?this.set(1,0,t.x,0,1,t.y,0,0,1):this.set(1,0,t,0,1,e,0,0,1),this}makeRotation(t){let e=Math.cos(t),n=Math.sin(t);return this.set(e,-n,0,n,e,0,0,0,1),this}makeScale(t,e){return this.set(t,0,0,0,e,0,0,0,1),this}equals(t){let e=this.elements,n=t.elements;for(let s=0;s<9;s++)if(e[s]!==n[s])return!1;return!0}fromArray(t,e=0){for(let n=0;n<9;n++)this.elements[n]=t[n+e];return this}toArray(t=[],e=0){let n=this.elements;return t[e]=n[0],t[e+1]=n[1],t[e+2]=n[2],t[e+3]=n[3],t[e+4]=n[4],t[e+5]=n[5],t[e+6]=n[6],t[e+7]=n[7],t[e+8]=n[8],t}clone(){return new this.constructor().fromArray(this.elements)}},Pu=new ie,Rp=new ie().set(.4123908,.3575843,.1804808,.212639,.7151687,.0721923,.0193308,.1191948,.9505322),Ip=new ie().set(3.2409699,-1.5373832,-.4986108,-.9692436,1.8759675,.0415551,.0556301,-.203977,1.0569715);function Sx(){let i={enabled:!0,workingColorSpace:ba,spaces:{},convert:function(s,r,o){return this.enabled===!1||r===o||!r||!o||(this.spaces[r].transfer===Re&&(s.r=Rs(s.r),s.g=Rs(s.g),s.b=Rs(s.b)),this.spaces[r].primaries!==this.spaces[o].primaries&&(s.applyMatrix3(this.spaces[r].toXYZ),s.applyMatrix3(this.spaces[o].fromXYZ)),this.spaces[o].transfer===Re&&(s.r=So(s.r),s.g=So(s.g),s.b=So(s.b))),s},workingToColorSpace:function(s,r){return this.convert(s,this.workingColorSpace,r)},colorSpaceToWorking:function(s,r){return this.convert(s,r,this.workingColorSpace)},getPrimaries:function(s){return this.spaces[s].primaries},getTransfer:function(s){return s===Fs?Ma:this.spaces[s].transfer},getToneMappingMode:function(s){return this.spaces[s].outputColorSpaceConfig.toneMappingMode||"standard"},getLuminanceCoefficients:function(s,r=this.workingColorSpace){return s.fromArray(this.spaces[r].luminanceCoefficients)},define:function(s){Object.assign(this.spaces,s)},_getMatrix:function(s,r,o){return s.copy(this.spaces[o].fromXYZ).multiply(this.spaces[r].toXYZ)},_getDrawingBufferColorSpace:function(s){return this.spaces[s].outputColorSpaceConfig.drawingBufferColorSpace},_getUnpackColorSpace:function(s=this.workingColorSpace){return this.spaces[s].workingColorSpaceConfig.unpackColorSpace}},t=[.64,.33,.3,.6,.15,.06],e=[.2126,.7152,.0722],n=[.3127,.329];return i.define({[ba]:{primaries:t,whitePoint:n,transfer:Ma,toXYZ:Rp,fromXYZ:Ip,luminanceCoefficients:e,workingColorSpaceConfig:{unpackColorSpace:jn},outputColorSpaceConfig:{drawingBufferColorSpace:jn}},[jn]:{primaries:t,whitePoint:n,transfer:Re,toXYZ:Rp,fromXYZ:Ip,luminanceCoefficients:e,outputColorSpaceConfig:{drawingBufferColorSpace:jn}}}),i}var ye=Sx();function Rs(i){return i<.04045?i*.0773993808:Math.pow(i*.9478672986+.0521327014,2.4)}function So(i){return i<.0031308?i*12.92:1.055*Math.pow(i,.41666)-.055}var so,xc=class{static getDataURL(t,e="image/png"){if(/^data:/i.test(t.src)||typeof HTMLCanvasElement>"u")return t.src;let n;if(t instanceof HTMLCanvasElement)n=t;else{so===void 0&&(so=wa("canvas")),so.width=t.width,so.height=t.height;let s=so.getContext("2d");t instanceof ImageData?s.putImageData(t,0,0):s.drawImage(t,0,0,t.width,t.height),n=so}return n.toDataURL(e)}static sRGBToLinear(t){if(typeof HTMLImageElement<"u"&&t instanceof HTMLImageElement||typeof HTMLCanvasElement<"u"&&t instanceof HTMLCanvasElement||typeof ImageBitmap<"u"&&t instanceof ImageBitmap){let e=wa("canvas");e.width=t.width,e.height=t.height;let n=e.getContext("2d");n.drawImage(t,0,0,t.width,t.height);let s=n.getImageData(0,0,t.width,t.height),r=s.data;for(let o=0;o<r.length;o++)r[o]=Rs(r[o]/255)*255;return n.putImageData(s,0,0),e}else if(t.data){let e=t.data.slice(0);for(let n=0;n<e.length;n++)e instanceof Uint8Array||e instanceof Uint8ClampedArray?e[n]=Math.floor(Rs(e[n]/255)*255):e[n]=Rs(e[n]);return{data:e,width:t.width,height:t.height}}else return $t("ImageUtils.sRGBToLinear(): Unsupported image type. No color space conversion applied."),t}},bx=0,Ao=class{constructor(t=null){this.isTextureSource=!0,Object.defineProperty(this,"id",{value:bx++}),this.uuid=hr(),this.data=t,this.dataReady=!0,this.version=0}getSize(t){let e=this.data;return typeof HTMLVideoElement<"u"&&e instanceof HTMLVideoElement?t.set(e.videoWidth,e.videoHeight,0):typeof VideoFrame<"u"&&e instanceof VideoFrame?t.set(e.displayWidth,e.displayHeight,0):e!==null?t.set(e.width||0,e.height||0,e.depth||0):t.set(0,0,0),t}set needsUpdate(t){t===!0&&this.version++}toJSON(t){let e=t===void 0||typeof t=="string";if(!e&&t.images[this.uuid]!==void 0)return t.images[this.uuid];let n={uuid:this.uuid,url:""},s=this.data;if(s!==null){let r;if(Array.isArray(s)){r=[];for(let o=0,a=s.length;o<a;o++)s[o].isDataTexture?r.push(Lu(s[o].image)):r.push(Lu(s[o]))}else r=Lu(s);n.url=r}return e||(t.images[this.uuid]=n),n}};function Lu(i){return typeof HTMLImageElement<"u"&&i instanceof HTMLImageElement||typeof HTMLCanvasElement<"u"&&i instanceof HTMLCanvasElement||typeof ImageBitmap<"u"&&i instanceof ImageBitmap?xc.getDataURL(i):i.data?{data:Array.from(i.data),width:i.width,height:i.height,type:i.data.constructor.name}:($t("Texture: Unable to serialize Texture."),{})}var Mx=0,Du=new k,ei=class i extends zi{constructor(t=i.DEFAULT_IMAGE,e=i.DEFAULT_MAPPING,n=ls,s=ls,r=ti,o=Us,a=Xi,l=oi,c=i.DEFAULT_ANISOTROPY,u=Fs){super(),this.isTexture=!0,Object.defineProperty(this,"id",{value:Mx++}),this.uuid=hr(),this.name="",this.source=new Ao(t),this.mipmaps=[],this.mapping=e,this.channel=0,this.wrapS=n,this.wrapT=s,this.magFilter=r,this.minFilter=o,this.anisotropy=c,this.format=a,this.internalFormat=null,this.type=l,this.offset=new Zt(0,0),this.repeat=new Zt(1,1),this.center=new Zt(0,0),this.rotation=0,this.matrixAutoUpdate=!0,this.matrix=new ie,this.generateMipmaps=!0,this.mipmapsAutoUpdate=!0,this.premultiplyAlpha=!1,this.flipY=!0,this.unpackAlignment=4,this.colorSpace=u,this.userData={},this.updateRanges=[],this.version=0,this.onUpdate=null,this.renderTarget=null,this.isRenderTargetTexture=!1,this.isArrayTexture=!!(t&&t.depth&&t.depth>1),this.pmremVersion=0,this.isPMREMTexture=!1,this.normalized=!1}get width(){return this.source.getSize(Du).x}get height(){return this.source.getSize(Du).y}get depth(){return this.source.getSize(Du).z}get image(){return this.source.data}set image(t){this.source.data=t}updateMatrix(){this.matrix.setUvTransform(this.offset.x,this.offset.y,this.repeat.x,this.repeat.y,this.rotation,this.center.x,this.center.y)}addUpdateRange(t,e){this.updateRanges.push({start:t,count:e})}clearUpdateRanges(){this.updateRanges.length=0}clone(){return new this.constructor().copy(this)}copy(t){return this.name=t.name,this.source=t.source,this.mipmaps=t.mipmaps.slice(0),this.mapping=t.mapping,this.channel=t.channel,this.wrapS=t.wrapS,this.wrapT=t.wrapT,this.magFilter=t.magFilter,this.minFilter=t.minFilter,this.anisotropy=t.anisotropy,this.format=t.format,this.internalFormat=t.internalFormat,this.type=t.type,this.normalized=t.normalized,this.offset.copy(t.offset),this.repeat.copy(t.repeat),this.center.copy(t.center),this.rotation=t.rotation,this.matrixAutoUpdate=t.matrixAutoUpdate,this.matrix.copy(t.matrix),this.generateMipmaps=t.generateMipmaps,this.mipmapsAutoUpdate=t.mipmapsAutoUpdate,this.premultiplyAlpha=t.premultiplyAlpha,this.flipY=t.flipY,this.unpackAlignment=t.unpackAlignment,this.colorSpace=t.colorSpace,this.renderTarget=t.renderTarget,this.isRenderTargetTexture=t.isRenderTargetTexture,this.isPMREMTexture=t.isPMREMTexture,this.isArrayTexture=t.isArrayTexture,this.userData=JSON.parse(JSON.stringify(t.userData)),this.needsUpdate=!0,this}setValues(t){for(let e in t){let n=t[e];if(n===void 0){$t(`Texture.setValues(): parameter '${e}' has value of undefined.`);continue}let s=this[e];if(s===void 0){$t(`Texture.setValues(): property '${e}' does not exist.`);continue}s&&n&&s.isVector2&&n.isVector2||s&&n&&s.isVector3&&n.isVector3||s&&n&&s.isMatrix3&&n.isMatrix3?s.copy(n):this[e]=n}}toJSON(t){let e=t===void 0||typeof t=="string";if(!e&&t.textures[this.uuid]!==void 0)return t.textures[this.uuid];let n={metadata:{version:4.7,type:"Texture",generator:"Texture.toJSON"},uuid:this.uuid,name:this.name,image:this.source.toJSON(t).uuid,mapping:this.mapping,channel:this.channel,repeat:[this.repeat.x,this.repeat.y],offset:[this.offset.x,this.offset.y],center:[this.center.x,this.center.y],rotation:this.rotation,wrap:[this.wrapS,this.wrapT],format:this.format,internalFormat:this.internalFormat,type:this.type,normalized:this.normalized,colorSpace:this.colorSpace,minFilter:this.minFilter,magFilter:this.magFilter,anisotropy:this.anisotropy,flipY:this.flipY,generateMipmaps:this.generateMipmaps,mipmapsAutoUpdate:this.mipmapsAutoUpdate,premultiplyAlpha:this.premultiplyAlpha,unpackAlignment:this.unpackAlignment};return Object.keys(this.userData).length>0&&(n.userData=this.userData),e||(t.textures[this.uuid]=n),n}dispose(){this.dispatchEvent({type:"dispose"})}transformUv(t){if(this.mapping!==Sd)return t;if(t.applyMatrix3(this.matrix),t.x<0||t.x>1)switch(this.wrapS){case mc:t.x=t.x-Math.floor(t.x);break;case ls:t.x=t.x<0?0:1;break;case gc:Math.abs(Math.floor(t.x)%2)===1?t.x=Math.ceil(t.x)-t.x:t.x=t.x-Math.floor(t.x);break}if(t.y<0||t.y>1)switch(this.wrapT){case mc:t.y=t.y-Math.floor(t.y);break;case ls:t.y=t.y<0?0:1;break;case gc:Math.abs(Math.floor(t.y)%2)===1?t.y=Math.ceil(t.y)-t.y:t.y=t.y-Math.floor(t.y);break}return this.flipY&&(t.y=1-t.y),t}set needsUpdate(t){t===!0&&(this.version++,this.source.needsUpdate=!0)}set needsPMREMUpdate(t){t===!0&&this.pmremVersion++}};ei.DEFAULT_IMAGE=null;ei.DEFAULT_MAPPING=Sd;ei.DEFAULT_ANISOTROPY=1;var Ie=class{static{this.prototype.isVector4=!0}constructor(t=0,e=0,n=0,s=1){this.x=t,this.y=e,this.z=n,this.w=s}get width(){return this.z}set width(t){this.z=t}get height(){return this.w}set height(t){this.w=t}set(t,e,n,s){return this.x=t,this.y=e,this.z=n,this.w=s,this}setScalar(t){return this.x=t,this.y=t,this.z=t,this.w=t,this}setX(t){return this.x=t,this}setY(t){return this.y=t,this}setZ(t){return this.z=t,this}setW(t){return this.w=t,this}setComponent(t,e){switch(t){case 0:this.x=e;break;case 1:this.y=e;break;case 2:this.z=e;break;case 3:this.w=e;break;default:throw new Error("THREE.Vector4: index is out of range: "+t)}return this}getComponent(t){switch(t){case 0:return this.x;case 1:return this.y;case 2:return this.z;case 3:return this.w;default:throw new Error("THREE.Vector4: index is out of range: "+t)}}clone(){return new this.constructor(this.x,this.y,this.z,this.w)}copy(t){return this.x=t.x,this.y=t.y,this.z=t.z,this.w=t.w!==void 0?t.w:1,this}add(t){return this.x+=t.x,this.y+=t.y,this.z+=t.z,this.w+=t.w,this}addScalar(t){return this.x+=t,this.y+=t,this.z+=t,this.w+=t,this}addVectors(t,e){return this.x=t.x+e.x,this.y=t.y+e.y,this.z=t.z+e.z,this.w=t.w+e.w,this}addScaledVector(t,e){return this.x+=t.x*e,this.y+=t.y*e,this.z+=t.z*e,this.w+=t.w*e,this}sub(t){return this.x-=t.x,this.y-=t.y,this.z-=t.z,this.w-=t.w,this}subScalar(t){return this.x-=t,this.y-=t,this.z-=t,this.w-=t,this}subVectors(t,e){return this.x=t.x-e.x,this.y=t.y-e.y,this.z=t.z-e.z,this.w=t.w-e.w,this}multiply(t){return this.x*=t.x,this.y*=t.y,this.z*=t.z,this.w*=t.w,this}multiplyScalar(t){return this.x*=t,this.y*=t,this.z*=t,this.w*=t,this}applyMatrix4(t){let e=this.x,n=this.y,s=this.z,r=this.w,o=t.elements;return this.x=o[0]*e+o[4]*n+o[8]*s+o[12]*r,this.y=o[1]*e+o[5]*n+o[9]*s+o[13]*r,this.z=o[2]*e+o[6]*n+o[10]*s+o[14]*r,this.w=o[3]*e+o[7]*n+o[11]*s+o[15]*r,this}divide(t){return this.x/=t.x,this.y/=t.y,this.z/=t.z,this.w/=t.w,this}divideScalar(t){return this.multiplyScalar(1/t)}setAxisAngleFromQuaternion(t){this.w=2*Math.acos(t.w);let e=Math.sqrt(1-t.w*t.w);return e<1e-4?(this.x=1,this.y=0,this.z=0):(this.x=t.x/e,this.y=t.y/e,this.z=t.z/e),this}setAxisAngleFromRotationMatrix(t){let e,n,s,r,l=t.elements,c=l[0],u=l[4],h=l[8],d=l[1],f=l[5],m=l[9],y=l[2],p=l[6],g=l[10];if(Math.abs(u-d)<.01&&Math.abs(h-y)<.01&&Math.abs(m-p)<.01){if(Math.abs(u+d)<.1&&Math.abs(h+y)<.1&&Math.abs(m+p)<.1&&Math.abs(c+f+g-3)<.1)return this.set(1,0,0,0),this;e=Math.PI;let E=(c+1)/2,b=(f+1)/2,I=(g+1)/2,A=(u+d)/4,x=(h+y)/4,T=(m+p)/4;return E>b&&E>I?E<.01?(n=0,s=.707106781,r=.707106781):(n=Math.sqrt(E),s=A/n,r=x/n):b>I?b<.01?(n=.707106781,s=0,r=.707106781):(s=Math.sqrt(b),n=A/s,r=T/s):I<.01?(n=.707106781,s=.707106781,r=0):(r=Math.sqrt(I),n=x/r,s=T/r),this.set(n,s,r,e),this}let v=Math.sqrt((p-m)*(p-m)+(h-y)*(h-y)+(d-u)*(d-u));return Math.abs(v)<.001&&(v=1),this.x=(p-m)/v,this.y=(h-y)/v,this.z=(d-u)/v,this.w=Math.acos((c+f+g-1)/2),this}setFromMatrixPosition(t){let e=t.elements;return this.x=e[12],this.y=e[13],this.z=e[14],this.w=e[15],this}min(t){return this.x=Math.min(this.x,t.x),this.y=Math.min(this.y,t.y),this.z=Math.min(this.z,t.z),this.w=Math.min(this.w,t.w),this}max(t){return this.x=Math.max(this.x,t.x),this.y=Math.max(this.y,t.y),this.z=Math.max(this.z,t.z),this.w=Math.max(this.w,t.w),this}clamp(t,e){return this.x=le(this.x,t.x,e.x),this.y=le(this.y,t.y,e.y),this.z=le(this.z,t.z,e.z),this.w=le(this.w,t.w,e.w),this}clampScalar(t,e){return this.x=le(this.x,t,e),this.y=le(this.y,t,e),this.z=le(this.z,t,e),this.w=le(this.w,t,e),this}clampLength(t,e){let n=this.length();return this.divideScalar(n||1).multiplyScalar(le(n,t,e))}floor(){return this.x=Math.floor(this.x),this.y=Math.floor(this.y),this.z=Math.floor(this.z),this.w=Math.floor(this.w),this}ceil(){return this.x=Math.ceil(this.x),this.y=Math.ceil(this.y),this.z=Math.ceil(this.z),this.w=Math.ceil(this.w),this}round(){return this.x=Math.round(this.x),this.y=Math.round(this.y),this.z=Math.round(this.z),this.w=Math.round(this.w),this}roundToZero(){return this.x=Math.trunc(this.x),this.y=Math.trunc(this.y),this.z=Math.trunc(this.z),this.w=Math.trunc(this.w),this}negate(){return this.x=-this.x,this.y=-this.y,this.z=-this.z,this.w=-this.w,this}dot(t){return this.x*t.x+this.y*t.y+this.z*t.z+this.w*t.w}lengthSq(){return this.x*this.x+this.y*this.y+this.z*this.z+this.w*this.w}length(){return Math.sqrt(this.x*this.x+this.y*this.y+this.z*this.z+this.w*this.w)}manhattanLength(){return Math.abs(this.x)+Math.abs(this.y)+Math.abs(this.z)+Math.abs(this.w)}normalize(){return this.divideScalar(this.length()||1)}setLength(t){return this.normalize().multiplyScalar(t)}lerp(t,e){return this.x+=(t.x-this.x)*e,this.y+=(t.y-this.y)*e,this.z+=(t.z-this.z)*e,this.w+=(t.w-this.w)*e,this}lerpVectors(t,e,n){return this.x=t.x+(e.x-t.x)*n,this.y=t.y+(e.y-t.y)*n,this.z=t.z+(e.z-t.z)*n,this.w=t.w+(e.w-t.w)*n,this}equals(t){return t.x===this.x&&t.y===this.y&&t.z===this.z&&t.w===this.w}fromArray(t,e=0){return this.x=t[e],this.y=t[e+1],this.z=t[e+2],this.w=t[e+3],this}toArray(t=[],e=0){return t[e]=this.x,t[e+1]=this.y,t[e+2]=this.z,t[e+3]=this.w,t}fromBufferAttribute(t,e){return this.x=t.getX(e),this.y=t.getY(e),this.z=t.getZ(e),this.w=t.getW(e),this}random(){return this.x=Math.random(),this.y=Math.random(),this.z=Math.random(),this.w=Math.random(),this}*[Symbol.iterator](){yield this.x,yield this.y,yield this.z,yield this.w}},yc=class extends zi{constructor(t=1,e=1,n={}){super(),n=Object.assign({generateMipmaps:!1,internalFormat:null,minFilter:ti,depthBuffer:!0,stencilBuffer:!1,resolveColorBuffer:!0,resolveDepthBuffer:!0,resolveStencilBuffer:!0,storeMultisampledColorBuffer:!0,storeMultisampledDepthBuffer:!0,storeMultisampledStencilBuffer:!0,depthTexture:null,samples:0,count:1,depth:1,multiview:!1,useArrayDepthTexture:!1},n),this.isRenderTarget=!0,this.width=t,this.height=e,this.depth=n.depth,this.scissor=new Ie(0,0,t,e),this.scissorTest=!1,this.viewport=new Ie(0,0,t,e),this.textures=[];let s=n.count;for(let r=0;r<s;r++)this.textures[r]=new ei({width:t,height:e,depth:n.depth}),this.textures[r].isRenderTargetTexture=!0,this.textures[r].renderTarget=this;this._setTextureOptions(n),this.depthBuffer=n.depthBuffer,this.stencilBuffer=n.stencilBuffer,this.resolveColorBuffer=n.resolveColorBuffer,this.resolveDepthBuffer=n.resolveDepthBuffer,this.resolveStencilBuffer=n.resolveStencilBuffer,this.storeMultisampledColorBuffer=n.storeMultisampledColorBuffer,this.storeMultisampledDepthBuffer=n.storeMultisampledDepthBuffer,this.storeMultisampledStencilBuffer=n.storeMultisampledStencilBuffer,this._depthTexture=null,this.depthTexture=n.depthTexture,this.samples=n.samples,this.multiview=n.multiview,this.useArrayDepthTexture=n.useArrayDepthTexture}_setTextureOptions(t={}){let e={minFilter:ti,generateMipmaps:!1,flipY:!1,internalFormat:null};t.mapping!==void 0&&(e.mapping=t.mapping),t.wrapS!==void 0&&(e.wrapS=t.wrapS),t.wrapT!==void 0&&(e.wrapT=t.wrapT),t.wrapR!==void 0&&(e.wrapR=t.wrapR),t.magFilter!==void 0&&(e.magFilter=t.magFilter),t.minFilter!==void 0&&(e.minFilter=t.minFilter),t.format!==void 0&&(e.format=t.format),t.type!==void 0&&(e.type=t.type),t.anisotropy!==void 0&&(e.anisotropy=t.anisotropy),t.colorSpace!==void 0&&(e.colorSpace=t.colorSpace),t.flipY!==void 0&&(e.flipY=t.flipY),t.generateMipmaps!==void 0&&(e.generateMipmaps=t.generateMipmaps),t.mipmapsAutoUpdate!==void 0&&(e.mipmapsAutoUpdate=t.mipmapsAutoUpdate),t.internalFormat!==void 0&&(e.internalFormat=t.internalFormat);for(let n=0;n<this.textures.length;n++)this.textures[n].setValues(e)}get texture(){return this.textures[0]}set texture(t){this.textures[0]=t}set depthTexture(t){this._depthTexture!==null&&this._depthTexture.renderTarget===this&&(this._depthTexture.renderTarget=null),t!==null&&t.renderTarget===null&&(t.renderTarget=this),this._depthTexture=t}get depthTexture(){return this._depthTexture}setSize(t,e,n=1){if(this.width!==t||this.height!==e||this.depth!==n){this.width=t,this.height=e,this.depth=n;for(let s=0,r=this.textures.length;s<r;s++)this.textures[s].image.width=t,this.textures[s].image.height=e,this.textures[s].image.depth=n,this.textures[s].isData3DTexture!==!0&&(this.textures[s].isArrayTexture=this.textures[s].image.depth>1);this.dispose()}this.viewport.set(0,0,t,e),this.scissor.set(0,0,t,e)}clone(){return new this.constructor().copy(this)}copy(t){this.width=t.width,this.height=t.height,this.depth=t.depth,this.scissor.copy(t.scissor),this.scissorTest=t.scissorTest,this.viewport.copy(t.viewport),this.textures.length=0;for(let e=0,n=t.textures.length;e<n;e++){this.textures[e]=t.textures[e].clone(),this.textures[e].isRenderTargetTexture=!0,this.textures[e].renderTarget=this;let s=Object.assign({},t.textures[e].image);this.textures[e].source=new Ao(s)}if(this.depthBuffer=t.depthBuffer,this.stencilBuffer=t.stencilBuffer,this.resolveColorBuffer=t.resolveColorBuffer,this.resolveDepthBuffer=t.resolveDepthBuffer,this.resolveStencilBuffer=t.resolveStencilBuffer,this.storeMultisampledColorBuffer=t.storeMultisampledColorBuffer,this.storeMultisampledDepthBuffer=t.storeMultisampledDepthBuffer,this.storeMultisampledStencilBuffer=t.storeMultisampledStencilBuffer,t.depthTexture!==null)if(t.depthTexture.renderTarget===t){let e=t.depthTexture.clone();e.renderTarget=null,this.depthTexture=e}else this.depthTexture=t.depthTexture;else this.depthTexture=null;return this.samples=t.samples,this.multiview=t.multiview,this.useArrayDepthTexture=t.useArrayDepthTexture,this}dispose(){this.dispatchEvent({type:"dispose"})}},xi=class extends yc{constructor(t=1,e=1,n={}){super(t,e,n),this.isWebGLRenderTarget=!0}},Aa=class extends ei{constructor(t=null,e=1,n=1,s=1){super(null),this.isDataArrayTexture=!0,this.image={data:t,width:e,height:n,depth:s},this.magFilter=mn,this.minFilter=mn,this.wrapR=ls,this.generateMipmaps=!1,this.flipY=!1,this.unpackAlignment=1,this.layerUpdates=new Set}copy(t){return super.copy(t),this.wrapR=t.wrapR,this}addLayerUpdate(t){this.layerUpdates.add(t)}clearLayerUpdates(){this.layerUpdates.clear()}};var vc=class extends ei{constructor(t=null,e=1,n=1,s=1){super(null),this.isData3DTexture=!0,this.image={data:t,width:e,height:n,depth:s},this.magFilter=mn,this.minFilter=mn,this.wrapR=ls,this.generateMipmaps=!1,this.flipY=!1,this.unpackAlignment=1}copy(t){return super.copy(t),this.wrapR=t.wrapR,this}};var be=class i{static{this.prototype.isMatrix4=!0}constructor(t,e,n,s,r,o,a,l,c,u,h,d,f,m,y,p){this.elements=[1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1],t!==void 0&&this.set(t,e,n,s,r,o,a,l,c,u,h,d,f,m,y,p)}set(t,e,n,s,r,o,a,l,c,u,h,d,f,m,y,p){let g=this.elements;return g[0]=t,g[4]=e,g[8]=n,g[12]=s,g[1]=r,g[5]=o,g[9]=a,g[13]=l,g[2]=c,g[6]=u,g[10]=h,g[14]=d,g[3]=f,g[7]=m,g[11]=y,g[15]=p,this}identity(){return this.set(1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1),this}clone(){return new i().fromArray(this.elements)}copy(t){let e=this.elements,n=t.elements;return e[0]=n[0],e[1]=n[1],e[2]=n[2],e[3]=n[3],e[4]=n[4],e[5]=n[5],e[6]=n[6],e[7]=n[7],e[8]=n[8],e[9]=n[9],e[10]=n[10],e[11]=n[11],e[12]=n[12],e[13]=n[13],e[14]=n[14],e[15]=n[15],this}copyPosition(t){let e=this.elements,n=t.elements;return e[12]=n[12],e[13]=n[13],e[14]=n[14],this}setFromMatrix3(t){let e=t.elements;return this.set(e[0],e[3],e[6],0,e[1],e[4],e[7],0,e[2],e[5],e[8],0,0,0,0,1),this}extractBasis(t,e,n){return this.determinantAffine()===0?(t.set(1,0,0),e.set(0,1,0),n.set(0,0,1),this):(t.setFromMatrixColumn(this,0),e.setFromMatrixColumn(this,1),n.setFromMatrixColumn(this,2),this)}makeBasis(t,e,n){return this.set(t.x,e.x,n.x,0,t.y,e.y,n.y,0,t.z,e.z,n.z,0,0,0,0,1),this}extractRotation(t){if(t.determinantAffine()===0)return this.identity();let e=this.elements,n=t.elements,s=1/ro.setFromMatrixColumn(t,0).length(),r=1/ro.setFromMatrixColumn(t,1).length(),o=1/ro.setFromMatrixColumn(t,2).length();return e[0]=n[0]*s,e[1]=n[1]*s,e[2]=n[2]*s,e[3]=0,e[4]=n[4]*r,e[5]=n[5]*r,e[6]=n[6]*r,e[7]=0,e[8]=n[8]*o,e[9]=n[9]*o,e[10]=n[10]*o,e[11]=0,e[12]=0,e[13]=0,e[14]=0,e[15]=1,this}makeRotationFromEuler(t){let e=this.elements,n=t.x,s=t.y,r=t.z,o=Math.cos(n),a=Math.sin(n),l=Math.cos(s),c=Math.sin(s),u=Math.cos(r),h=Math.sin(r);if(t.order==="XYZ"){let d=o*u,f=o*h,m=a*u,y=a*h;e[0]=l*u,e[4]=-l*h,e[8]=c,e[1]=f+m*c,e[5]=d-y*c,e[9]=-a*l,e[2]=y-d*c,e[6]=m+f*c,e[10]=o*l}else if(t.order==="YXZ"){let d=l*u,f=l*h,m=c*u,y=c*h;e[0]=d+y*a,e[4]=m*a-f,e[8]=o*c,e[1]=o*h,e[5]=o*u,e[9]=-a,e[2]=f*a-m,e[6]=y+d*a,e[10]=o*l}else if(t.order==="ZXY"){let d=l*u,f=l*h,m=c*u,y=c*h;e[0]=d-y*a,e[4]=-o*h,e[8]=m+f*a,e[1]=f+m*a,e[5]=o*u,e[9]=y-d*a,e[2]=-o*c,e[6]=a,e[10]=o*l}else if(t.order==="ZYX"){let d=o*u,f=o*h,m=a*u,y=a*h;e[0]=l*u,e[4]=m*c-f,e[8]=d*c+y,e[1]=l*h,e[5]=y*c+d,e[9]=f*c-m,e[2]=-c,e[6]=a*l,e[10]=o*l}else if(t.order==="YZX"){let d=o*l,f=o*c,m=a*l,y=a*c;e[0]=l*u,e[4]=y-d*h,e[8]=m*h+f,e[1]=h,e[5]=o*u,e[9]=-a*u,e[2]=-c*u,e[6]=f*h+m,e[10]=d-y*h}else if(t.order==="XZY"){let d=o*l,f=o*c,m=a*l,y=a*c;e[0]=l*u,e[4]=-h,e[8]=c*u,e[1]=d*h+y,e[5]=o*u,e[9]=f*h-m,e[2]=m*h-f,e[6]=a*u,e[10]=y*h+d}return e[3]=0,e[7]=0,e[11]=0,e[12]=0,e[13]=0,e[14]=0,e[15]=1,this}makeRotationFromQuaternion(t){return this.compose(wx,t,Tx)}lookAt(t,e,n){let s=this.elements;return mi.subVectors(t,e),mi.lengthSq()===0&&(mi.z=1),mi.normalize(),Ks.crossVectors(n,mi),Ks.lengthSq()===0&&(Math.abs(n.z)===1?mi.x+=1e-4:mi.z+=1e-4,mi.normalize(),Ks.crossVectors(n,mi)),Ks.normalize(),Ll.crossVectors(mi,Ks),s[0]=Ks.x,s[4]=Ll.x,s[8]=mi.x,s[1]=Ks.y,s[5]=Ll.y,s[9]=mi.y,s[2]=Ks.z,s[6]=Ll.z,s[10]=mi.z,this}multiply(t){return this.multiplyMatrices(this,t)}premultiply(t){return this.multiplyMatrices(t,this)}multiplyMatrices(t,e){let n=t.elements,s=e.elements,r=this.elements,o=n[0],a=n[4],l=n[8],c=n[12],u=n[1],h=n[5],d=n[9],f=n[13],m=n[2],y=n[6],p=n[10],g=n[14],v=n[3],E=n[7],b=n[11],I=n[15],A=s[0],x=s[4],T=s[8],V=s[12],N=s[1],L=s[5],X=s[9],q=s[13],D=s[2],W=s[6],J=s[10],H=s[14],ht=s[3],j=s[7],tt=s[11],rt=s[15];return r[0]=o*A+a*N+l*D+c*ht,r[4]=o*x+a*L+l*W+c*j,r[8]=o*T+a*X+l*J+c*tt,r[12]=o*V+a*q+l*H+c*rt,r[1]=u*A+h*N+d*D+f*ht,r[5]=u*x+h*L+d*W+f*j,r[9]=u*T+h*X+d*J+f*tt,r[13]=u*V+h*q+d*H+f*rt,r[2]=m*A+y*N+p*D+g*ht,r[6]=m*x+y*L+p*W+g*j,r[10]=m*T+y*X+p*J+g*tt,r[14]=m*V+y*q+p*H+g*rt,r[3]=v*A+E*N+b*D+I*ht,r[7]=v*x+E*L+b*W+I*j,r[11]=v*T+E*X+b*J+I*tt,r[15]=v*V+E*q+b*H+I*rt,this}multiplyScalar(t){let e=this.elements;return e[0]*=t,e[4]*=t,e[8]*=t,e[12]*=t,e[1]*=t,e[5]*=t,e[9]*=t,e[13]*=t,e[2]*=t,e[6]*=t,e[10]*=t,e[14]*=t,e[3]*=t,e[7]*=t,e[11]*=t,e[15]*=t,this}determinant(){let t=this.elements,e=t[0],n=t[4],s=t[8],r=t[12],o=t[1],a=t[5],l=t[9],c=t[13],u=t[2],h=t[6],d=t[10],f=t[14],m=t[3],y=t[7],p=t[11],g=t[15],v=l*f-c*d,E=a*f-c*h,b=a*d-l*h,I=o*f-c*u,A=o*d-l*u,x=o*h-a*u;return e*(y*v-p*E+g*b)-n*(m*v-p*I+g*A)+s*(m*E-y*I+g*x)-r*(m*b-y*A+p*x)}determinantAffine(){let t=this.elements,e=t[0],n=t[4],s=t[8],r=t[1],o=t[5],a=t[9],l=t[2],c=t[6],u=t[10];return e*(o*u-a*c)-n*(r*u-a*l)+s*(r*c-o*l)}transpose(){let t=this.elements,e;return e=t[1],t[1]=t[4],t[4]=e,e=t[2],t[2]=t[8],t[8]=e,e=t[6],t[6]=t[9],t[9]=e,e=t[3],t[3]=t[12],t[12]=e,e=t[7],t[7]=t[13],t[13]=e,e=t[11],t[11]=t[14],t[14]=e,this}setPosition(t,e,n){let s=this.elements;return t.isVector3?(s[12]=t.x,s[13]=t.y,s[14]=t.z):(s[12]=t,s[13]=e,s[14]=n),this}invert(){let t=this.elements,e=t[0],n=t[1],s=t[2],r=t[3],o=t[4],a=t[5],l=t[6],c=t[7],u=t[8],h=t[9],d=t[10],f=t[11],m=t[12],y=t[13],p=t[14],g=t[15],v=e*a-n*o,E=e*l-s*o,b=e*c-r*o,I=n*l-s*a,A=n*c-r*a,x=s*c-r*l,T=u*y-h*m,V=u*p-d*m,N=u*g-f*m,L=h*p-d*y,X=h*g-f*y,q=d*g-f*p,D=v*q-E*X+b*L+I*N-A*V+x*T;if(D===0)return this.set(0,0,0,0,0,0,0,0,0,0,0,0,0,0,0,0);let W=1/D;return t[0]=(a*q-l*X+c*L)*W,t[1]=(s*X-n*q-r*L)*W,t[2]=(y*x-p*A+g*I)*W,t[3]=(d*A-h*x-f*I)*W,t[4]=(l*N-o*q-c*V)*W,t[5]=(e*q-s*N+r*V)*W,t[6]=(p*b-m*x-g*E)*W,t[7]=(u*x-d*b+f*E)*W,t[8]=(o*X-a*N+c*T)*W,t[9]=(n*N-e*X-r*T)*W,t[10]=(m*A-y*b+g*v)*W,t[11]=(h*b-u*A-f*v)*W,t[12]=(a*V-o*L-l*T)*W,t[13]=(e*L-n*V+s*T)*W,t[14]=(y*E-m*I-p*v)*W,t[15]=(u*I-h*E+d*v)*W,this}scale(t){let e=this.elements,n=t.x,s=t.y,r=t.z;return e[0]*=n,e[4]*=s,e[8]*=r,e[1]*=n,e[5]*=s,e[9]*=r,e[2]*=n,e[6]*=s,e[10]*=r,e[3]*=n,e[7]*=s,e[11]*=r,this}getMaxScaleOnAxis(){let t=this.elements,e=t[0]*t[0]+t[1]*t[1]+t[2]*t[2],n=t[4]*t[4]+t[5]*t[5]+t[6]*t[6],s=t[8]*t[8]+t[9]*t[9]+t[10]*t[10];return Math.sqrt(Math.max(e,n,s))}makeTranslation(t,e,n){return t.isVector3?this.set(1,0,0,t.x,0,1,0,t.y,0,0,1,t.z,0,0,0,1):this.set(1,0,0,t,0,1,0,e,0,0,1,n,0,0,0,1),this}makeRotationX(t){let e=Math.cos(t),n=Math.sin(t);return this.set(1,0,0,0,0,e,-n,0,0,n,e,0,0,0,0,1),this}makeRotationY(t){let e=Math.cos(t),n=Math.sin(t);return this.set(e,0,n,0,0,1,0,0,-n,0,e,0,0,0,0,1),this}makeRotationZ(t){let e=Math.cos(t),n=Math.sin(t);return this.set(e,-n,0,0,n,e,0,0,0,0,1,0,0,0,0,1),this}makeRotationAxis(t,e){let n=Math.cos(e),s=Math.sin(e),r=1-n,o=t.x,a=t.y,l=t.z,c=r*o,u=r*a;return this.set(c*o+n,c*a-s*l,c*l+s*a,0,c*a+s*l,u*a+n,u*l-s*o,0,c*l-s*a,u*l+s*o,r*l*l+n,0,0,0,0,1),this}makeScale(t,e,n){return this.set(t,0,0,0,0,e,0,0,0,0,n,0,0,0,0,1),this}makeShear(t,e,n,s,r,o){return this.set(1,n,r,0,t,1,o,0,e,s,1,0,0,0,0,1),this}compose(t,e,n){let s=this.elements,r=e._x,o=e._y,a=e._z,l=e._w,c=r+r,u=o+o,h=a+a,d=r*c,f=r*u,m=r*h,y=o*u,p=o*h,g=a*h,v=l*c,E=l*u,b=l*h,I=n.x,A=n.y,x=n.z;return s[0]=(1-(y+g))*I,s[1]=(f+b)*I,s[2]=(m-E)*I,s[3]=0,s[4]=(f-b)*A,s[5]=(1-(d+g))*A,s[6]=(p+v)*A,s[7]=0,s[8]=(m+E)*x,s[9]=(p-v)*x,s[10]=(1-(d+y))*x,s[11]=0,s[12]=t.x,s[13]=t.y,s[14]=t.z,s[15]=1,this}decompose(t,e,n){let s=this.elements;t.x=s[12],t.y=s[13],t.z=s[14];let r=this.determinantAffine();if(r===0)return n.set(1,1,1),e.identity(),this;let o=ro.set(s[0],s[1],s[2]).length(),a=ro.set(s[4],s[5],s[6]).length(),l=ro.set(s[8],s[9],s[10]).length();r<0&&(o=-o),Fi.copy(this);let c=1/o,u=1/a,h=1/l;return Fi.elements[0]*=c,Fi.elements[1]*=c,Fi.elements[2]*=c,Fi.elements[4]*=u,Fi.elements[5]*=u,Fi.elements[6]*=u,Fi.elements[8]*=h,Fi.elements[9]*=h,Fi.elements[10]*=h,e.setFromRotationMatrix(Fi),n.x=o,n.y=a,n.z=l,this}makePerspective(t,e,n,s,r,o,a=Ei,l=!1){let c=this.elements,u=2*r/(e-t),h=2*r/(n-s),d=(e+t)/(e-t),f=(n+s)/(n-s),m,y;if(l)m=r/(o-r),y=o*r/(o-r);else if(a===Ei)m=-(o+r)/(o-r),y=-2*o*r/(o-r);else if(a===Mo)m=-o/(o-r),y=-o*r/(o-r);else throw new Error("THREE.Matrix4.makePerspective(): Invalid coordinate system: "+a);return c[0]=u,c[4]=0,c[8]=d,c[12]=0,c[1]=0,c[5]=h,c[9]=f,c[13]=0,c[2]=0,c[6]=0,c[10]=m,c[14]=y,c[3]=0,c[7]=0,c[11]=-1,c[15]=0,this}makeOrthographic(t,e,n,s,r,o,a=Ei,l=!1){let c=this.elements,u=2/(e-t),h=2/(n-s),d=-(e+t)/(e-t),f=-(n+s)/(n-s),m,y;if(l)m=1/(o-r),y=o/(o-r);else if(a===Ei)m=-2/(o-r),y=-(o+r)/(o-r);else if(a===Mo)m=-1/(o-r),y=-r/(o-r);else throw new Error("THREE.Matrix4.makeOrthographic(): Invalid coordinate system: "+a);return c[0]=u,c[4]=0,c[8]=0,c[12]=d,c[1]=0,c[5]=h,c[9]=0,c[13]=f,c[2]=0,c[6]=0,c[10]=m,c[14]=y,c[3]=0,c[7]=0,c[11]=0,c[15]=1,this}equals(t){let e=this.elements,n=t.elements;for(let s=0;s<16;s++)if(e[s]!==n[s])return!1;return!0}fromArray(t,e=0){for(let n=0;n<16;n++)this.elements[n]=t[n+e];return this}toArray(t=[],e=0){let n=this.elements;return t[e]=n[0],t[e+1]=n[1],t[e+2]=n[2],t[e+3]=n[3],t[e+4]=n[4],t[e+5]=n[5],t[e+6]=n[6],t[e+7]=n[7],t[e+8]=n[8],t[e+9]=n[9],t[e+10]=n[10],t[e+11]=n[11],t[e+12]=n[12],t[e+13]=n[13],t[e+14]=n[14],t[e+15]=n[15],t}},ro=new k,Fi=new be,wx=new k(0,0,0),Tx=new k(1,1,1),Ks=new k,Ll=new k,mi=new k,Pp=new be,Lp=new Je,Ps=class i{constructor(t=0,e=0,n=0,s=i.DEFAULT_ORDER){this.isEuler=!0,this._x=t,this._y=e,this._z=n,this._order=s}get x(){return this._x}set x(t){this._x=t,this._onChangeCallback()}get y(){return this._y}set y(t){this._y=t,this._onChangeCallback()}get z(){return this._z}set z(t){this._z=t,this._onChangeCallback()}get order(){return this._order}set order(t){this._order=t,this._onChangeCallback()}set(t,e,n,s=this._order){return this._x=t,this._y=e,this._z=n,this._order=s,this._onChangeCallback(),this}clone(){return new this.constructor(this._x,this._y,this._z,this._order)}copy(t){return this._x=t._x,this._y=t._y,this._z=t._z,this._order=t._order,this._onChangeCallback(),this}setFromRotationMatrix(t,e=this._order,n=!0){let s=t.elements,r=s[0],o=s[4],a=s[8],l=s[1],c=s[5],u=s[9],h=s[2],d=s[6],f=s[10];switch(e){case"XYZ":this._y=Math.asin(le(a,-1,1)),Math.abs(a)<.9999999?(this._x=Math.atan2(-u,f),this._z=Math.atan2(-o,r)):(this._x=Math.atan2(d,c),this._z=0);break;case"YXZ":this._x=Math.asin(-le(u,-1,1)),Math.abs(u)<.9999999?(this._y=Math.atan2(a,f),this._z=Math.atan2(l,c)):(this._y=Math.atan2(-h,r),this._z=0);break;case"ZXY":this._x=Math.asin(le(d,-1,1)),Math.abs(d)<.9999999?(this._y=Math.atan2(-h,f),this._z=Math.atan2(-o,c)):(this._y=0,this._z=Math.atan2(l,r));break;case"ZYX":this._y=Math.asin(-le(h,-1,1)),Math.abs(h)<.9999999?(this._x=Math.atan2(d,f),this._z=Math.atan2(l,r)):(this._x=0,this._z=Math.atan2(-o,c));break;case"YZX":this._z=Math.asin(le(l,-1,1)),Math.abs(l)<.9999999?(this._x=Math.atan2(-u,c),this._y=Math.atan2(-h,r)):(this._x=0,this._y=Math.atan2(a,f));break;case"XZY":this._z=Math.asin(-le(o,-1,1)),Math.abs(o)<.9999999?(this._x=Math.atan2(d,c),this._y=Math.atan2(a,r)):(this._x=Math.atan2(-u,f),this._y=0);break;default:$t("Euler: .setFromRotationMatrix() encountered an unknown order: "+e)}return this._order=e,n===!0&&this._onChangeCallback(),this}setFromQuaternion(t,e,n){return Pp.makeRotationFromQuaternion(t),this.setFromRotationMatrix(Pp,e,n)}setFromVector3(t,e=this._order){return this.set(t.x,t.y,t.z,e)}reorder(t){return Lp.setFromEuler(this),this.setFromQuaternion(Lp,t)}equals(t){return t._x===this._x&&t._y===this._y&&t._z===this._z&&t._order===this._order}fromArray(t){return this._x=t[0],this._y=t[1],this._z=t[2],t[3]!==void 0&&(this._order=t[3]),this._onChangeCallback(),this}toArray(t=[],e=0){return t[e]=this._x,t[e+1]=this._y,t[e+2]=this._z,t[e+3]=this._order,t}_onChange(t){return this._onChangeCallback=t,this}_onChangeCallback(){}*[Symbol.iterator](){yield this._x,yield this._y,yield this._z,yield this._order}};Ps.DEFAULT_ORDER="XYZ";var Eo=class{constructor(){this.mask=1}set(t){this.mask=(1<<t|0)>>>0}enable(t){this.mask|=1<<t|0}enableAll(){this.mask=-1}toggle(t){this.mask^=1<<t|0}disable(t){this.mask&=~(1<<t|0)}disableAll(){this.mask=0}test(t){return(this.mask&t.mask)!==0}isEnabled(t){return(this.mask&(1<<t|0))!==0}},Ax=0,Dp=new k,oo=new Je,bs=new be,Dl=new k,pa=new k,Ex=new k,Cx=new Je,Np=new k(1,0,0),Up=new k(0,1,0),Op=new k(0,0,1),Fp={type:"added"},Rx={type:"removed"},ao={type:"childadded",child:null},Nu={type:"childremoved",child:null},Un=class i extends zi{constructor(){super(),this.isObject3D=!0,Object.defineProperty(this,"id",{value:Ax++}),this.uuid=hr(),this.name="",this.type="Object3D",this.parent=null,this.children=[],this.up=i.DEFAULT_UP.clone();let t=new k,e=new Ps,n=new Je,s=new k(1,1,1);function r(){n.setFromEuler(e,!1)}function o(){e.setFromQuaternion(n,void 0,!1)}e._onChange(r),n._onChange(o),Object.defineProperties(this,{position:{configurable:!0,enumerable:!0,value:t},rotation:{configurable:!0,enumerable:!0,value:e},quaternion:{configurable:!0,enumerable:!0,value:n},scale:{configurable:!0,enumerable:!0,value:s},modelViewMatrix:{value:new be},normalMatrix:{value:new ie}}),this.matrix=new be,this.matrixWorld=new be,this.matrixAutoUpdate=i.DEFAULT_MATRIX_AUTO_UPDATE,this.matrixWorldAutoUpdate=i.DEFAULT_MATRIX_WORLD_AUTO_UPDATE,this.matrixWorldNeedsUpdate=!1,this.layers=new Eo,this.visible=!0,this.castShadow=!1,this.receiveShadow=!1,this.frustumCulled=!0,this.renderOrder=0,this.animations=[],this.customDepthMaterial=void 0,this.customDistanceMaterial=void 0,this.static=!1,this.userData={},this.pivot=null}onBeforeShadow(){}onAfterShadow(){}onBeforeRender(){}onAfterRender(){}applyMatrix4(t){this.matrixAutoUpdate&&this.updateMatrix(),this.matrix.premultiply(t),this.matrix.decompose(this.position,this.quaternion,this.scale),this.pivot!==null&&this.position.copy(this.pivot).applyMatrix4(this.matrix).sub(this.pivot)}applyQuaternion(t){return this.quaternion.premultiply(t),this}setRotationFromAxisAngle(t,e){this.quaternion.setFromAxisAngle(t,e)}setRotationFromEuler(t){this.quaternion.setFromEuler(t,!0)}setRotationFromMatrix(t){this.quaternion.setFromRotationMatrix(t)}setRotationFromQuaternion(t){this.quaternion.copy(t)}rotateOnAxis(t,e){return oo.setFromAxisAngle(t,e),this.quaternion.multiply(oo),this}rotateOnWorldAxis(t,e){return oo.setFromAxisAngle(t,e),this.quaternion.premultiply(oo),this}rotateX(t){return this.rotateOnAxis(Np,t)}rotateY(t){return this.rotateOnAxis(Up,t)}rotateZ(t){return this.rotateOnAxis(Op,t)}translateOnAxis(t,e){return Dp.copy(t).applyQuaternion(this.quaternion),this.position.add(Dp.multiplyScalar(e)),this}translateX(t){return this.translateOnAxis(Np,t)}translateY(t){return this.translateOnAxis(Up,t)}translateZ(t){return this.translateOnAxis(Op,t)}localToWorld(t){return this.updateWorldMatrix(!0,!1),t.applyMatrix4(this.matrixWorld)}worldToLocal(t){return this.updateWorldMatrix(!0,!1),t.applyMatrix4(bs.copy(this.matrixWorld).invert())}lookAt(t,e,n){t.isVector3?Dl.copy(t):Dl.set(t,e,n);let s=this.parent;this.updateWorldMatrix(!0,!1),pa.setFromMatrixPosition(this.matrixWorld),this.isCamera||this.isLight?bs.lookAt(pa,Dl,this.up):bs.lookAt(Dl,pa,this.up),this.quaternion.setFromRotationMatrix(bs),s&&(bs.extractRotation(s.matrixWorld),oo.setFromRotationMatrix(bs),this.quaternion.premultiply(oo.invert()))}add(t){if(arguments.length>1){for(let e=0;e<arguments.length;e++)this.add(arguments[e]);return this}return t===this?(ee("Object3D.add: object can't be added as a child of itself.",t),this):(t&&t.isObject3D?(t.removeFromParent(),t.parent=this,this.children.push(t),t.dispatchEvent(Fp),ao.child=t,this.dispatchEvent(ao),ao.child=null):ee("Object3D.add: object not an instance of THREE.Object3D.",t),this)}remove(t){if(arguments.length>1){for(let n=0;n<arguments.length;n++)this.remove(arguments[n]);return this}let e=this.children.indexOf(t);return e!==-1&&(t.parent=null,this.children.splice(e,1),t.dispatchEvent(Rx),Nu.child=t,this.dispatchEvent(Nu),Nu.child=null),this}removeFromParent(){let t=this.parent;return t!==null&&t.remove(this),this}clear(){return this.remove(...this.children)}attach(t){return this.updateWorldMatrix(!0,!1),bs.copy(this.matrixWorld).invert(),t.parent!==null&&(t.parent.updateWorldMatrix(!0,!1),bs.multiply(t.parent.matrixWorld)),t.applyMatrix4(bs),t.removeFromParent(),t.parent=this,this.children.push(t),t.updateWorldMatrix(!1,!0),t.dispatchEvent(Fp),ao.child=t,this.dispatchEvent(ao),ao.child=null,this}getObjectById(t){return this.getObjectByProperty("id",t)}getObjectByName(t){return this.getObjectByProperty("name",t)}getObjectByProperty(t,e){if(this[t]===e)return this;for(let n=0,s=this.children.length;n<s;n++){let o=this.children[n].getObjectByProperty(t,e);if(o!==void 0)return o}}getObjectsByProperty(t,e,n=[]){this[t]===e&&n.push(this);let s=this.children;for(let r=0,o=s.length;r<o;r++)s[r].getObjectsByProperty(t,e,n);return n}getWorldPosition(t){return this.updateWorldMatrix(!0,!1),t.setFromMatrixPosition(this.matrixWorld)}getWorldQuaternion(t){return this.updateWorldMatrix(!0,!1),this.matrixWorld.decompose(pa,t,Ex),t}getWorldScale(t){return this.updateWorldMatrix(!0,!1),this.matrixWorld.decompose(pa,Cx,t),t}getWorldDirection(t){this.updateWorldMatrix(!0,!1);let e=this.matrixWorld.elements;return t.set(e[8],e[9],e[10]).normalize()}raycast(){}intersectsFrustum(){return!0}traverse(t){t(this);let e=this.children;for(let n=0,s=e.length;n<s;n++)e[n].traverse(t)}traverseVisible(t){if(this.visible===!1)return;t(this);let e=this.children;for(let n=0,s=e.length;n<s;n++)e[n].traverseVisible(t)}traverseAncestors(t){let e=this.parent;e!==null&&(t(e),e.traverseAncestors(t))}updateMatrix(){this.matrix.compose(this.position,this.quaternion,this.scale);let t=this.pivot;if(t!==null){let e=t.x,n=t.y,s=t.z,r=this.matrix.elements;r[12]+=e-r[0]*e-r[4]*n-r[8]*s,r[13]+=n-r[1]*e-r[5]*n-r[9]*s,r[14]+=s-r[2]*e-r[6]*n-r[10]*s}this.matrixWorldNeedsUpdate=!0}updateMatrixWorld(t){this.matrixAutoUpdate&&this.updateMatrix(),(this.matrixWorldNeedsUpdate||t)&&(this.matrixWorldAutoUpdate===!0&&(this.parent===null?this.matrixWorld.copy(this.matrix):this.matrixWorld.multiplyMatrices(this.parent.matrixWorld,this.matrix)),this.matrixWorldNeedsUpdate=!1,t=!0);let e=this.children;for(let n=0,s=e.length;n<s;n++)e[n].updateMatrixWorld(t)}updateWorldMatrix(t,e,n=!1){let s=this.parent;if(t===!0&&s!==null&&s.updateWorldMatrix(!0,!1),this.matrixAutoUpdate&&this.updateMatrix(),(this.matrixWorldNeedsUpdate||n)&&(this.matrixWorldAutoUpdate===!0&&(this.parent===null?this.matrixWorld.copy(this.matrix):this.matrixWorld.multiplyMatrices(this.parent.matrixWorld,this.matrix)),this.matrixWorldNeedsUpdate=!1,n=!0),e===!0){let r=this.children;for(let o=0,a=r.length;o<a;o++)r[o].updateWorldMatrix(!1,!0,n)}}toJSON(t){let e=t===void 0||typeof t=="string",n={};e&&(t={geometries:{},materials:{},textures:{},images:{},shapes:{},skeletons:{},animations:{},nodes:{}},n.metadata={version:4.7,type:"Object",generator:"Object3D.toJSON"});let s={};s.uuid=this.uuid,s.type=this.type,s.name=this.name,s.castShadow=this.castShadow,s.receiveShadow=this.receiveShadow,s.visible=this.visible,s.frustumCulled=this.frustumCulled,s.renderOrder=this.renderOrder,s.static=this.static,s.matrixAutoUpdate=this.matrixAutoUpdate,Object.keys(this.userData).length>0&&(s.userData=this.userData),s.layers=this.layers.mask,s.matrix=this.matrix.toArray(),s.up=this.up.toArray(),this.pivot!==null&&(s.pivot=this.pivot.toArray()),this.morphTargetDictionary!==void 0&&(s.morphTargetDictionary=Object.assign({},this.morphTargetDictionary)),this.morphTargetInfluences!==void 0&&(s.morphTargetInfluences=this.morphTargetInfluences.slice()),this.isInstancedMesh&&(s.type="InstancedMesh",s.count=this.count,s.instanceMatrix=this.instanceMatrix.toJSON(),this.instanceColor!==null&&(s.instanceColor=this.instanceColor.toJSON())),this.isBatchedMesh&&(s.type="BatchedMesh",s.perObjectFrustumCulled=this.perObjectFrustumCulled,s.sortObjects=this.sortObjects,s.drawRanges=this._drawRanges,s.reservedRanges=this._reservedRanges,s.geometryInfo=this._geometryInfo.map(a=>({...a,boundingBox:a.boundingBox?a.boundingBox.toJSON():void 0,boundingSphere:a.boundingSphere?a.boundingSphere.toJSON():void 0})),s.instanceInfo=this._instanceInfo.map(a=>({...a})),s.availableInstanceIds=this._availableInstanceIds.slice(),s.availableGeometryIds=this._availableGeometryIds.slice(),s.nextIndexStart=this._nextIndexStart,s.nextVertexStart=this._nextVertexStart,s.geometryCount=this._geometryCount,s.maxInstanceCount=this._maxInstanceCount,s.maxVertexCount=this._maxVertexCount,s.maxIndexCount=this._maxIndexCount,s.geometryInitialized=this._geometryInitialized,s.matricesTexture=this._matricesTexture.toJSON(t),s.indirectTexture=this._indirectTexture.toJSON(t),this._colorsTexture!==null&&(s.colorsTexture=this._colorsTexture.toJSON(t)),this.boundingSphere!==null&&(s.boundingSphere=this.boundingSphere.toJSON()),this.boundingBox!==null&&(s.boundingBox=this.boundingBox.toJSON()));function r(a,l){return a[l.uuid]===void 0&&(a[l.uuid]=l.toJSON(t)),l.uuid}if(this.isScene)this.background&&(this.background.isColor?s.background=this.background.toJSON():this.background.isTexture&&(s.background=this.background.toJSON(t).uuid)),this.environment&&this.environment.isTexture&&this.environment.isRenderTargetTexture!==!0&&(s.environment=this.environment.toJSON(t).uuid);else if(this.isMesh||this.isLine||this.isPoints){s.geometry=r(t.geometries,this.geometry);let a=this.geometry.parameters;if(a!==void 0&&a.shapes!==void 0){let l=a.shapes;if(Array.isArray(l))for(let c=0,u=l.length;c<u;c++){let h=l[c];r(t.shapes,h)}else r(t.shapes,l)}}if(this.isSkinnedMesh&&(s.bindMode=this.bindMode,s.bindMatrix=this.bindMatrix.toArray(),this.skeleton!==void 0&&(r(t.skeletons,this.skeleton),s.skeleton=this.skeleton.uuid)),this.material!==void 0)if(Array.isArray(this.material)){let a=[];for(let l=0,c=this.material.length;l<c;l++)a.push(r(t.materials,this.material[l]));s.material=a}else s.material=r(t.materials,this.material);if(this.children.length>0){s.children=[];for(let a=0;a<this.children.length;a++)s.children.push(this.children[a].toJSON(t).object)}if(this.animations.length>0){s.animations=[];for(let a=0;a<this.animations.length;a++){let l=this.animations[a];s.animations.push(r(t.animations,l))}}if(e){let a=o(t.geometries),l=o(t.materials),c=o(t.textures),u=o(t.images),h=o(t.shapes),d=o(t.skeletons),f=o(t.animations),m=o(t.nodes);a.length>0&&(n.geometries=a),l.length>0&&(n.materials=l),c.length>0&&(n.textures=c),u.length>0&&(n.images=u),h.length>0&&(n.shapes=h),d.length>0&&(n.skeletons=d),f.length>0&&(n.animations=f),m.length>0&&(n.nodes=m)}return n.object=s,n;function o(a){let l=[];for(let c in a){let u=a[c];delete u.metadata,l.push(u)}return l}}clone(t){return new this.constructor().copy(this,t)}copy(t,e=!0){if(this.name=t.name,this.up.copy(t.up),this.position.copy(t.position),this.rotation.order=t.rotation.order,this.quaternion.copy(t.quaternion),this.scale.copy(t.scale),this.pivot=t.pivot!==null?t.pivot.clone():null,this.matrix.copy(t.matrix),this.matrixWorld.copy(t.matrixWorld),this.matrixAutoUpdate=t.matrixAutoUpdate,this.matrixWorldAutoUpdate=t.matrixWorldAutoUpdate,this.matrixWorldNeedsUpdate=t.matrixWorldNeedsUpdate,this.layers.mask=t.layers.mask,this.visible=t.visible,this.castShadow=t.castShadow,this.receiveShadow=t.receiveShadow,this.frustumCulled=t.frustumCulled,this.renderOrder=t.renderOrder,this.static=t.static,this.animations=t.animations.slice(),this.userData=JSON.parse(JSON.stringify(t.userData)),e===!0)for(let n=0;n<t.children.length;n++){let s=t.children[n];this.add(s.clone())}return this}dispose(){this.dispatchEvent({type:"dispose"})}};Un.DEFAULT_UP=new k(0,1,0);Un.DEFAULT_MATRIX_AUTO_UPDATE=!0;Un.DEFAULT_MATRIX_WORLD_AUTO_UPDATE=!0;var Cs=class extends Un{constructor(){super(),this.isGroup=!0,this.type="Group"}},Ix={type:"move"},Co=class{constructor(){this._targetRay=null,this._grip=null,this._hand=null}getHandSpace(){return this._hand===null&&(this._hand=new Cs,this._hand.matrixAutoUpdate=!1,this._hand.visible=!1,this._hand.joints={},this._hand.inputState={pinching:!1}),this._hand}getTargetRaySpace(){return this._targetRay===null&&(this._targetRay=new Cs,this._targetRay.matrixAutoUpdate=!1,this._targetRay.visible=!1,this._targetRay.hasLinearVelocity=!1,this._targetRay.linearVelocity=new k,this._targetRay.hasAngularVelocity=!1,this._targetRay.angularVelocity=new k),this._targetRay}getGripSpace(){return this._grip===null&&(this._grip=new Cs,this._grip.matrixAutoUpdate=!1,this._grip.visible=!1,this._grip.hasLinearVelocity=!1,this._grip.linearVelocity=new k,this._grip.hasAngularVelocity=!1,this._grip.angularVelocity=new k,this._grip.eventsEnabled=!1),this._grip}dispatchEvent(t){return this._targetRay!==null&&this._targetRay.dispatchEvent(t),this._grip!==null&&this._grip.dispatchEvent(t),this._hand!==null&&this._hand.dispatchEvent(t),this}connect(t){if(t&&t.hand){let e=this._hand;if(e)for(let n of t.hand.values())this._getHandJoint(e,n)}return this.dispatchEvent({type:"connected",data:t}),this}disconnect(t){return this.dispatchEvent({type:"disconnected",data:t}),this._targetRay!==null&&(this._targetRay.visible=!1),this._grip!==null&&(this._grip.visible=!1),this._hand!==null&&(this._hand.visible=!1),this}update(t,e,n){let s=null,r=null,o=null,a=this._targetRay,l=this._grip,c=this._hand;if(t&&e.session.visibilityState!=="visible-blurred"){if(c&&t.hand){o=!0;for(let y of t.hand.values()){let p=e.getJointPose(y,n),g=this._getHandJoint(c,y);p!==null&&(g.matrix.fromArray(p.transform.matrix),g.matrix.decompose(g.position,g.quaternion,g.scale),g.matrixWorldNeedsUpdate=!0,g.jointRadius=p.radius),g.visible=p!==null}let u=c.joints["index-finger-tip"],h=c.joints["thumb-tip"],d=u.position.distanceTo(h.position),f=.02,m=.005;c.inputState.pinching&&d>f+m?(c.inputState.pinching=!1,this.dispatchEvent({type:"pinchend",handedness:t.handedness,target:this})):!c.inputState.pinching&&d<=f-m&&(c.inputState.pinching=!0,this.dispatchEvent({type:"pinchstart",handedness:t.handedness,target:this}))}else l!==null&&t.gripSpace&&(r=e.getPose(t.gripSpace,n),r!==null&&(l.matrix.fromArray(r.transform.matrix),l.matrix.decompose(l.position,l.quaternion,l.scale),l.matrixWorldNeedsUpdate=!0,r.linearVelocity?(l.hasLinearVelocity=!0,l.linearVelocity.copy(r.linearVelocity)):l.hasLinearVelocity=!1,r.angularVelocity?(l.hasAngularVelocity=!0,l.angularVelocity.copy(r.angularVelocity)):l.hasAngularVelocity=!1,l.eventsEnabled&&l.dispatchEvent({type:"gripUpdated",data:t,target:this})));a!==null&&(s=e.getPose(t.targetRaySpace,n),s===null&&r!==null&&(s=r),s!==null&&(a.matrix.fromArray(s.transform.matrix),a.matrix.decompose(a.position,a.quaternion,a.scale),a.matrixWorldNeedsUpdate=!0,s.linearVelocity?(a.hasLinearVelocity=!0,a.linearVelocity.copy(s.linearVelocity)):a.hasLinearVelocity=!1,s.angularVelocity?(a.hasAngularVelocity=!0,a.angularVelocity.copy(s.angularVelocity)):a.hasAngularVelocity=!1,this.dispatchEvent(Ix)))}return a!==null&&(a.visible=s!==null),l!==null&&(l.visible=r!==null),c!==null&&(c.visible=o!==null),this}_getHandJoint(t,e){if(t.joints[e.jointName]===void 0){let n=new Cs;n.matrixAutoUpdate=!1,n.visible=!1,t.joints[e.jointName]=n,t.add(n)}return t.joints[e.jointName]}},Hm={aliceblue:15792383,antiquewhite:16444375,aqua:65535,aquamarine:8388564,azure:15794175,beige:16119260,bisque:16770244,black:0,blanchedalmond:16772045,blue:255,blueviolet:9055202,brown:10824234,burlywood:14596231,cadetblue:6266528,chartreuse:8388352,chocolate:13789470,coral:16744272,cornflowerblue:6591981,cornsilk:16775388,crimson:14423100,cyan:65535,darkblue:139,darkcyan:35723,darkgoldenrod:12092939,darkgray:11119017,darkgreen:25600,darkgrey:11119017,darkkhaki:12433259,darkmagenta:9109643,darkolivegreen:5597999,darkorange:16747520,darkorchid:10040012,darkred:9109504,darksalmon:15308410,darkseagreen:9419919,darkslateblue:4734347,darkslategray:3100495,darkslategrey:3100495,darkturquoise:52945,darkviolet:9699539,deeppink:16716947,deepskyblue:49151,dimgray:6908265,dimgrey:6908265,dodgerblue:2003199,firebrick:11674146,floralwhite:16775920,forestgreen:2263842,fuchsia:16711935,gainsboro:14474460,ghostwhite:16316671,gold:16766720,goldenrod:14329120,gray:8421504,green:32768,greenyellow:11403055,grey:8421504,honeydew:15794160,hotpink:16738740,indianred:13458524,indigo:4915330,ivory:16777200,khaki:15787660,lavender:15132410,lavenderblush:16773365,lawngreen:8190976,lemonchiffon:16775885,lightblue:11393254,lightcoral:15761536,lightcyan:14745599,lightgoldenrodyellow:16448210,lightgray:13882323,lightgreen:9498256,lightgrey:13882323,lightpink:16758465,lightsalmon:16752762,lightseagreen:2142890,lightskyblue:8900346,lightslategray:7833753,lightslategrey:7833753,lightsteelblue:11584734,lightyellow:16777184,lime:65280,limegreen:3329330,linen:16445670,magenta:16711935,maroon:8388608,mediumaquamarine:6737322,mediumblue:205,mediumorchid:12211667,mediumpurple:9662683,mediumseagreen:3978097,mediumslateblue:8087790,mediumspringgreen:64154,mediumturquoise:4772300,mediumvioletred:13047173,midnightblue:1644912,mintcream:16121850,mistyrose:16770273,moccasin:16770229,navajowhite:16768685,navy:128,oldlace:16643558,olive:8421376,olivedrab:7048739,orange:16753920,orangered:16729344,orchid:14315734,palegoldenrod:15657130,palegreen:10025880,paleturquoise:11529966,palevioletred:14381203,papayawhip:16773077,peachpuff:16767673,peru:13468991,pink:16761035,plum:14524637,powderblue:11591910,purple:8388736,rebeccapurple:6697881,red:16711680,rosybrown:12357519,royalblue:4286945,saddlebrown:9127187,salmon:16416882,sandybrown:16032864,seagreen:3050327,seashell:16774638,sienna:10506797,silver:12632256,skyblue:8900331,slateblue:6970061,slategray:7372944,slategrey:7372944,snow:16775930,springgreen:65407,steelblue:4620980,tan:13808780,teal:32896,thistle:14204888,tomato:16737095,turquoise:4251856,violet:15631086,wheat:16113331,white:16777215,whitesmoke:16119285,yellow:16776960,yellowgreen:10145074},Zs={h:0,s:0,l:0},Nl={h:0,s:0,l:0};function Uu(i,t,e){return e<0&&(e+=1),e>1&&(e-=1),e<1/6?i+(t-i)*6*e:e<1/2?t:e<2/3?i+(t-i)*6*(2/3-e):i}var he=class{constructor(t,e,n){return this.isColor=!0,this.r=1,this.g=1,this.b=1,this.set(t,e,n)}set(t,e,n){if(e===void 0&&n===void 0){let s=t;s&&s.isColor?this.copy(s):typeof s=="number"?this.setHex(s):typeof s=="string"&&this.setStyle(s)}else this.setRGB(t,e,n);return this}setScalar(t){return this.r=t,this.g=t,this.b=t,this}setHex(t,e=jn){return t=Math.floor(t),this.r=(t>>16&255)/255,this.g=(t>>8&255)/255,this.b=(t&255)/255,ye.colorSpaceToWorking(this,e),this}setRGB(t,e,n,s=ye.workingColorSpace){return this.r=t,this.g=e,this.b=n,ye.colorSpaceToWorking(this,s),this}setHSL(t,e,n,s=ye.workingColorSpace){if(t=Nd(t,1),e=le(e,0,1),n=le(n,0,1),e===0)this.r=this.g=this.b=n;else{let r=n<=.5?n*(1+e):n+e-n*e,o=2*n-r;this.r=Uu(o,r,t+1/3),this.g=Uu(o,r,t),this.b=Uu(o,r,t-1/3)}return ye.colorSpaceToWorking(this,s),this}setStyle(t,e=jn){function n(r){r!==void 0&&parseFloat(r)<1&&$t("Color: Alpha component of "+t+" will be ignored.")}let s;if(s=/^(\w+)\(([^\)]*)\)/.exec(t)){let r,o=s[1],a=s[2];switch(o){case"rgb":case"rgba":if(r=/^\s*(\d+)\s*,\s*(\d+)\s*,\s*(\d+)\s*(?:,\s*(\d+(?:\.\d+)?|\.\d+)\s*)?$/.exec(a))return n(r[4]),this.setRGB(Math.min(255,parseInt(r[1],10))/255,Math.min(255,parseInt(r[2],10))/255,Math.min(255,parseInt(r[3],10))/255,e);if(r=/^\s*(\d+(?:\.\d+)?|\.\d+)\%\s*,\s*(\d+(?:\.\d+)?|\.\d+)\%\s*,\s*(\d+(?:\.\d+)?|\.\d+)\%\s*(?:,\s*(\d+(?:\.\d+)?|\.\d+)\s*)?$/.exec(a))return n(r[4]),this.setRGB(Math.min(100,parseFloat(r[1]))/100,Math.min(100,parseFloat(r[2]))/100,Math.min(100,parseFloat(r[3]))/100,e);break;case"hsl":case"hsla":if(r=/^\s*([+-]?(?:\d+(?:\.\d+)?|\.\d+))\s*,\s*(\d+(?:\.\d+)?|\.\d+)\%\s*,\s*(\d+(?:\.\d+)?|\.\d+)\%\s*(?:,\s*(\d+(?:\.\d+)?|\.\d+)\s*)?$/.exec(a))return n(r[4]),this.setHSL(parseFloat(r[1])/360,parseFloat(r[2])/100,parseFloat(r[3])/100,e);break;default:$t("Color: Unknown color model "+t)}}else if(s=/^\#([A-Fa-f\d]+)$/.exec(t)){let r=s[1],o=r.length;if(o===3)return this.setRGB(parseInt(r.charAt(0),16)/15,parseInt(r.charAt(1),16)/15,parseInt(r.charAt(2),16)/15,e);if(o===6)return this.setHex(parseInt(r,16),e);$t("Color: Invalid hex color "+t)}else if(t&&t.length>0)return this.setColorName(t,e);return this}setColorName(t,e=jn){let n=Hm[t.toLowerCase()];return n!==void 0?this.setHex(n,e):$t("Color: Unknown color "+t),this}clone(){return new this.constructor(this.r,this.g,this.b)}copy(t){return this.r=t.r,this.g=t.g,this.b=t.b,this}copySRGBToLinear(t){return this.r=Rs(t.r),this.g=Rs(t.g),this.b=Rs(t.b),this}copyLinearToSRGB(t){return this.r=So(t.r),this.g=So(t.g),this.b=So(t.b),this}convertSRGBToLinear(){return this.copySRGBToLinear(this),this}convertLinearToSRGB(){return this.copyLinearToSRGB(this),this}getHex(t=jn){return ye.workingToColorSpace(Hn.copy(this),t),Math.round(le(Hn.r*255,0,255))*65536+Math.round(le(Hn.g*255,0,255))*256+Math.round(le(Hn.b*255,0,255))}getHexString(t=jn){return("000000"+this.getHex(t).toString(16)).slice(-6)}getHSL(t,e=ye.workingColorSpace){ye.workingToColorSpace(Hn.copy(this),e);let n=Hn.r,s=Hn.g,r=Hn.b,o=Math.max(n,s,r),a=Math.min(n,s,r),l,c,u=(a+o)/2;if(a===o)l=0,c=0;else{let h=o-a;switch(c=u<=.5?h/(o+a):h/(2-o-a),o){case n:l=(s-r)/h+(s<r?6:0);break;case s:l=(r-n)/h+2;break;case r:l=(n-s)/h+4;break}l/=6}return t.h=l,t.s=c,t.l=u,t}getRGB(t,e=ye.workingColorSpace){return ye.workingToColorSpace(Hn.copy(this),e),t.r=Hn.r,t.g=Hn.g,t.b=Hn.b,t}getStyle(t=jn){ye.workingToColorSpace(Hn.copy(this),t);let e=Hn.r,n=Hn.g,s=Hn.b;return t!==jn?`color(${t} ${e.toFixed(3)} ${n.toFixed(3)} ${s.toFixed(3)})`:`rgb(${Math.round(e*255)},${Math.round(n*255)},${Math.round(s*255)})`}offsetHSL(t,e,n){return this.getHSL(Zs),this.setHSL(Zs.h+t,Zs.s+e,Zs.l+n)}add(t){return this.r+=t.r,this.g+=t.g,this.b+=t.b,this}addColors(t,e){return this.r=t.r+e.r,this.g=t.g+e.g,this.b=t.b+e.b,this}addScalar(t){return this.r+=t,this.g+=t,this.b+=t,this}sub(t){return this.r=Math.max(0,this.r-t.r),this.g=Math.max(0,this.g-t.g),this.b=Math.max(0,this.b-t.b),this}multiply(t){return this.r*=t.r,this.g*=t.g,this.b*=t.b,this}multiplyScalar(t){return this.r*=t,this.g*=t,this.b*=t,this}lerp(t,e){return this.r+=(t.r-this.r)*e,this.g+=(t.g-this.g)*e,this.b+=(t.b-this.b)*e,this}lerpColors(t,e,n){return this.r=t.r+(e.r-t.r)*n,this.g=t.g+(e.g-t.g)*n,this.b=t.b+(e.b-t.b)*n,this}lerpHSL(t,e){this.getHSL(Zs),t.getHSL(Nl);let n=va(Zs.h,Nl.h,e),s=va(Zs.s,Nl.s,e),r=va(Zs.l,Nl.l,e);return this.setHSL(n,s,r),this}setFromVector3(t){return this.r=t.x,this.g=t.y,this.b=t.z,this}applyMatrix3(t){let e=this.r,n=this.g,s=this.b,r=t.elements;return this.r=r[0]*e+r[3]*n+r[6]*s,this.g=r[1]*e+r[4]*n+r[7]*s,this.b=r[2]*e+r[5]*n+r[8]*s,this}equals(t){return t.r===this.r&&t.g===this.g&&t.b===this.b}fromArray(t,e=0){return this.r=t[e],this.g=t[e+1],this.b=t[e+2],this}toArray(t=[],e=0){return t[e]=this.r,t[e+1]=this.g,t[e+2]=this.b,t}fromBufferAttribute(t,e){return this.r=t.getX(e),this.g=t.getY(e),this.b=t.getZ(e),this}toJSON(){return this.getHex()}*[Symbol.iterator](){yield this.r,yield this.g,yield this.b}},Hn=new he;he.NAMES=Hm;var Ea=class extends Un{constructor(){super(),this.isScene=!0,this.type="Scene",this.background=null,this.environment=null,this.fog=null,this.backgroundBlurriness=0,this.backgroundIntensity=1,this.backgroundRotation=new Ps,this.environmentIntensity=1,this.environmentRotation=new Ps,this.overrideMaterial=null,typeof __THREE_DEVTOOLS__<"u"&&__THREE_DEVTOOLS__.dispatchEvent(new CustomEvent("observe",{detail:this}))}copy(t,e){return super.copy(t,e),this.background=t.background!==null?t.background.clone():null,this.environment=t.environment!==null?t.environment.clone():null,this.fog=t.fog!==null?t.fog.clone():null,this.backgroundBlurriness=t.backgroundBlurriness,this.backgroundIntensity=t.backgroundIntensity,this.backgroundRotation.copy(t.backgroundRotation),this.environmentIntensity=t.environmentIntensity,this.environmentRotation.copy(t.environmentRotation),this.overrideMaterial=t.overrideMaterial!==null?t.overrideMaterial.clone():null,this.matrixAutoUpdate=t.matrixAutoUpdate,this}toJSON(t){let e=super.toJSON(t);return this.fog!==null&&(e.object.fog=this.fog.toJSON()),e.object.backgroundBlurriness=this.backgroundBlurriness,e.object.backgroundIntensity=this.backgroundIntensity,e.object.backgroundRotation=this.backgroundRotation.toArray(),e.object.environmentIntensity=this.environmentIntensity,e.object.environmentRotation=this.environmentRotation.toArray(),e}},Bi=new k,Ms=new k,Ou=new k,ws=new k,lo=new k,co=new k,Bp=new k,Fu=new k,Bu=new k,ku=new k,zu=new Ie,Vu=new Ie,Gu=new Ie,Es=class i{constructor(t=new k,e=new k,n=new k){this.a=t,this.b=e,this.c=n}static getNormal(t,e,n,s){s.subVectors(n,e),Bi.subVectors(t,e),s.cross(Bi);let r=s.lengthSq();return r>0?s.multiplyScalar(1/Math.sqrt(r)):s.set(0,0,0)}static getBarycoord(t,e,n,s,r){Bi.subVectors(s,e),Ms.subVectors(n,e),Ou.subVectors(t,e);let o=Bi.dot(Bi),a=Bi.dot(Ms),l=Bi.dot(Ou),c=Ms.dot(Ms),u=Ms.dot(Ou),h=o*c-a*a;if(h===0)return r.set(0,0,0),null;let d=1/h,f=(c*l-a*u)*d,m=(o*u-a*l)*d;return r.set(1-f-m,m,f)}static containsPoint(t,e,n,s){return this.getBarycoord(t,e,n,s,ws)===null?!1:ws.x>=0&&ws.y>=0&&ws.x+ws.y<=1}static getInterpolation(t,e,n,s,r,o,a,l){return this.getBarycoord(t,e,n,s,ws)===null?(l.x=0,l.y=0,"z"in l&&(l.z=0),"w"in l&&(l.w=0),null):(l.setScalar(0),l.addScaledVector(r,ws.x),l.addScaledVector(o,ws.y),l.addScaledVector(a,ws.z),l)}static getInterpolatedAttribute(t,e,n,s,r,o){return zu.setScalar(0),Vu.setScalar(0),Gu.setScalar(0),zu.fromBufferAttribute(t,e),Vu.fromBufferAttribute(t,n),Gu.fromBufferAttribute(t,s),o.setScalar(0),o.addScaledVector(zu,r.x),o.addScaledVector(Vu,r.y),o.addScaledVector(Gu,r.z),o}static isFrontFacing(t,e,n,s){return Bi.subVectors(n,e),Ms.subVectors(t,e),Bi.cross(Ms).dot(s)<0}set(t,e,n){return this.a.copy(t),this.b.copy(e),this.c.copy(n),this}setFromPointsAndIndices(t,e,n,s){return this.a.copy(t[e]),this.b.copy(t[n]),this.c.copy(t[s]),this}setFromAttributeAndIndices(t,e,n,s){return this.a.fromBufferAttribute(t,e),this.b.fromBufferAttribute(t,n),this.c.fromBufferAttribute(t,s),this}clone(){return new this.constructor().copy(this)}copy(t){return this.a.copy(t.a),this.b.copy(t.b),this.c.copy(t.c),this}getArea(){return Bi.subVectors(this.c,this.b),Ms.subVectors(this.a,this.b),Bi.cross(Ms).length()*.5}getMidpoint(t){return t.addVectors(this.a,this.b).add(this.c).multiplyScalar(1/3)}getNormal(t){return i.getNormal(this.a,this.b,this.c,t)}getPlane(t){return t.setFromCoplanarPoints(this.a,this.b,this.c)}getBarycoord(t,e){return i.getBarycoord(t,this.a,this.b,this.c,e)}getInterpolation(t,e,n,s,r){return i.getInterpolation(t,this.a,this.b,this.c,e,n,s,r)}containsPoint(t){return i.containsPoint(t,this.a,this.b,this.c)}isFrontFacing(t){return i.isFrontFacing(this.a,this.b,this.c,t)}intersectsBox(t){return t.intersectsTriangle(this)}closestPointToPoint(t,e){let n=this.a,s=this.b,r=this.c,o,a;lo.subVectors(s,n),co.subVectors(r,n),Fu.subVectors(t,n);let l=lo.dot(Fu),c=co.dot(Fu);if(l<=0&&c<=0)return e.copy(n);Bu.subVectors(t,s);let u=lo.dot(Bu),h=co.dot(Bu);if(u>=0&&h<=u)return e.copy(s);let d=l*h-u*c;if(d<=0&&l>=0&&u<=0&&l-u>0)return o=l/(l-u),e.copy(n).addScaledVector(lo,o);ku.subVectors(t,r);let f=lo.dot(ku),m=co.dot(ku);if(m>=0&&f<=m)return e.copy(r);let y=f*c-l*m;if(y<=0&&c>=0&&m<=0)return a=c/(c-m),e.copy(n).addScaledVector(co,a);let p=u*m-f*h;if(p<=0&&h-u>=0&&f-m>=0)return Bp.subVectors(r,s),a=(h-u)/(h-u+(f-m)),e.copy(s).addScaledVector(Bp,a);let g=1/(p+y+d);return o=y*g,a=d*g,e.copy(n).addScaledVector(lo,o).addScaledVector(co,a)}equals(t){return t.a.equals(this.a)&&t.b.equals(this.b)&&t.c.equals(this.c)}},yi=class{constructor(t=new k(1/0,1/0,1/0),e=new k(-1/0,-1/0,-1/0)){this.isBox3=!0,this.min=t,this.max=e}set(t,e){return this.min.copy(t),this.max.copy(e),this}setFromArray(t){this.makeEmpty();for(let e=0,n=t.length;e<n;e+=3)this.expandByPoint(ki.fromArray(t,e));return this}setFromBufferAttribute(t){this.makeEmpty();for(let e=0,n=t.count;e<n;e++)this.expandByPoint(ki.fromBufferAttribute(t,e));return this}setFromPoints(t){this.makeEmpty();for(let e=0,n=t.length;e<n;e++)this.expandByPoint(t[e]);return this}setFromCenterAndSize(t,e){let n=ki.copy(e).multiplyScalar(.5);return this.min.copy(t).sub(n),this.max.copy(t).add(n),this}setFromObject(t,e=!1){return this.makeEmpty(),this.expandByObject(t,e)}clone(){return new this.constructor().copy(this)}copy(t){return this.min.copy(t.min),this.max.copy(t.max),this}makeEmpty(){return this.min.x=this.min.y=this.min.z=1/0,this.max.x=this.max.y=this.max.z=-1/0,this}isEmpty(){return this.max.x<this.min.x||this.max.y<this.min.y||this.max.z<this.min.z}getCenter(t){return this.isEmpty()?t.set(0,0,0):t.addVectors(this.min,this.max).multiplyScalar(.5)}getSize(t){return this.isEmpty()?t.set(0,0,0):t.subVectors(this.max,this.min)}expandByPoint(t){return this.min.min(t),this.max.max(t),this}expandByVector(t){return this.min.sub(t),this.max.add(t),this}expandByScalar(t){return this.min.addScalar(-t),this.max.addScalar(t),this}expandByObject(t,e=!1){t.updateWorldMatrix(!1,!1);let n=t.geometry;if(n!==void 0){let r=n.getAttribute("position");if(e===!0&&r!==void 0&&t.isInstancedMesh!==!0&&t.isBatchedMesh!==!0)for(let o=0,a=r.count;o<a;o++)t.isMesh===!0?t.getVertexPosition(o,ki):ki.fromBufferAttribute(r,o),ki.applyMatrix4(t.matrixWorld),this.expandByPoint(ki);else t.boundingBox!==void 0?(t.boundingBox===null&&t.computeBoundingBox(),Ul.copy(t.boundingBox)):(n.boundingBox===null&&n.computeBoundingBox(),Ul.copy(n.boundingBox)),Ul.applyMatrix4(t.matrixWorld),this.union(Ul)}let s=t.children;for(let r=0,o=s.length;r<o;r++)this.expandByObject(s[r],e);return this}containsPoint(t){return t.x>=this.min.x&&t.x<=this.max.x&&t.y>=this.min.y&&t.y<=this.max.y&&t.z>=this.min.z&&t.z<=this.max.z}containsBox(t){return this.min.x<=t.min.x&&t.max.x<=this.max.x&&this.min.y<=t.min.y&&t.max.y<=this.max.y&&this.min.z<=t.min.z&&t.max.z<=this.max.z}getParameter(t,e){return e.set((t.x-this.min.x)/(this.max.x-this.min.x),(t.y-this.min.y)/(this.max.y-this.min.y),(t.z-this.min.z)/(this.max.z-this.min.z))}intersectsBox(t){return t.max.x>=this.min.x&&t.min.x<=this.max.x&&t.max.y>=this.min.y&&t.min.y<=this.max.y&&t.max.z>=this.min.z&&t.min.z<=this.max.z}intersectsSphere(t){return this.clampPoint(t.center,ki),ki.distanceToSquared(t.center)<=t.radius*t.radius}intersectsPlane(t){let e,n;return t.normal.x>0?(e=t.normal.x*this.min.x,n=t.normal.x*this.max.x):(e=t.normal.x*this.max.x,n=t.normal.x*this.min.x),t.normal.y>0?(e+=t.normal.y*this.min.y,n+=t.normal.y*this.max.y):(e+=t.normal.y*this.max.y,n+=t.normal.y*this.min.y),t.normal.z>0?(e+=t.normal.z*this.min.z,n+=t.normal.z*this.max.z):(e+=t.normal.z*this.max.z,n+=t.normal.z*this.min.z),e<=-t.constant&&n>=-t.constant}intersectsTriangle(t){if(this.isEmpty())return!1;this.getCenter(ma),Ol.subVectors(this.max,ma),ho.subVectors(t.a,ma),uo.subVectors(t.b,ma),fo.subVectors(t.c,ma),Js.subVectors(uo,ho),js.subVectors(fo,uo),yr.subVectors(ho,fo);let e=[0,-Js.z,Js.y,0,-js.z,js.y,0,-yr.z,yr.y,Js.z,0,-Js.x,js.z,0,-js.x,yr.z,0,-yr.x,-Js.y,Js.x,0,-js.y,js.x,0,-yr.y,yr.x,0];return!Hu(e,ho,uo,fo,Ol)||(e=[1,0,0,0,1,0,0,0,1],!Hu(e,ho,uo,fo,Ol))?!1:(Fl.crossVectors(Js,js),e=[Fl.x,Fl.y,Fl.z],Hu(e,ho,uo,fo,Ol))}clampPoint(t,e){return e.copy(t).clamp(this.min,this.max)}distanceToPoint(t){return this.clampPoint(t,ki).distanceTo(t)}getBoundingSphere(t){return this.isEmpty()?t.makeEmpty():(this.getCenter(t.center),t.radius=this.getSize(ki).length()*.5),t}intersect(t){return this.min.max(t.min),this.max.min(t.max),this.isEmpty()&&this.makeEmpty(),this}union(t){return this.min.min(t.min),this.max.max(t.max),this}applyMatrix4(t){return this.isEmpty()?this:(Ts[0].set(this.min.x,this.min.y,this.min.z).applyMatrix4(t),Ts[1].set(this.min.x,this.min.y,this.max.z).applyMatrix4(t),Ts[2].set(this.min.x,this.max.y,this.min.z).applyMatrix4(t),Ts[3].set(this.min.x,this.max.y,this.max.z).applyMatrix4(t),Ts[4].set(this.max.x,this.min.y,this.min.z).applyMatrix4(t),Ts[5].set(this.max.x,this.min.y,this.max.z).applyMatrix4(t),Ts[6].set(this.max.x,this.max.y,this.min.z).applyMatrix4(t),Ts[7].set(this.max.x,this.max.y,this.max.z).applyMatrix4(t),this.setFromPoints(Ts),this)}translate(t){return this.min.add(t),this.max.add(t),this}equals(t){return t.min.equals(this.min)&&t.max.equals(this.max)}toJSON(){return{min:this.min.toArray(),max:this.max.toArray()}}fromJSON(t){return this.min.fromArray(t.min),this.max.fromArray(t.max),this}},Ts=[new k,new k,new k,new k,new k,new k,new k,new k],ki=new k,Ul=new yi,ho=new k,uo=new k,fo=new k,Js=new k,js=new k,yr=new k,ma=new k,Ol=new k,Fl=new k,vr=new k;function Hu(i,t,e,n,s){for(let r=0,o=i.length-3;r<=o;r+=3){vr.fromArray(i,r);let a=s.x*Math.abs(vr.x)+s.y*Math.abs(vr.y)+s.z*Math.abs(vr.z),l=t.dot(vr),c=e.dot(vr),u=n.dot(vr);if(Math.max(-Math.max(l,c,u),Math.min(l,c,u))>a)return!1}return!0}var pn=new k,Bl=new Zt,Px=0,vn=class extends zi{constructor(t,e,n=!1){if(super(),Array.isArray(t))throw new TypeError("THREE.BufferAttribute: array should be a Typed Array.");this.isBufferAttribute=!0,Object.defineProperty(this,"id",{value:Px++}),this.name="",this.array=t,this.itemSize=e,this.count=t!==void 0?t.length/e:0,this.normalized=n,this.usage=Ld,this.updateRanges=[],this.gpuType=Hi,this.version=0,this._normalizationScale=t!==void 0?Ch(t):void 0}onUploadCallback(){}set needsUpdate(t){t===!0&&this.version++}setUsage(t){return this.usage=t,this}addUpdateRange(t,e){this.updateRanges.push({start:t,count:e})}clearUpdateRanges(){this.updateRanges.length=0}copy(t){return this.name=t.name,this.array=new t.array.constructor(t.array),this.itemSize=t.itemSize,this.count=t.count,this.normalized=t.normalized,this.usage=t.usage,this.gpuType=t.gpuType,this._normalizationScale=t._normalizationScale,this}copyAt(t,e,n){t*=this.itemSize,n*=e.itemSize;for(let s=0,r=this.itemSize;s<r;s++)this.array[t+s]=e.array[n+s];return this}copyArray(t){return this.array.set(t),this}applyMatrix3(t){if(this.itemSize===2)for(let e=0,n=this.count;e<n;e++)Bl.fromBufferAttribute(this,e),Bl.applyMatrix3(t),this.setXY(e,Bl.x,Bl.y);else if(this.itemSize===3)for(let e=0,n=this.count;e<n;e++)pn.fromBufferAttribute(this,e),pn.applyMatrix3(t),this.setXYZ(e,pn.x,pn.y,pn.z);return this}applyMatrix4(t){for(let e=0,n=this.count;e<n;e++)pn.fromBufferAttribute(this,e),pn.applyMatrix4(t),this.setXYZ(e,pn.x,pn.y,pn.z);return this}applyNormalMatrix(t){for(let e=0,n=this.count;e<n;e++)pn.fromBufferAttribute(this,e),pn.applyNormalMatrix(t),this.setXYZ(e,pn.x,pn.y,pn.z);return this}transformDirection(t){for(let e=0,n=this.count;e<n;e++)pn.fromBufferAttribute(this,e),pn.transformDirection(t),this.setXYZ(e,pn.x,pn.y,pn.z);return this}set(t,e=0){return this.array.set(t,e),this}getComponent(t,e){let n=this.array[t*this.itemSize+e];return this.normalized&&(n=this._denormalize(n)),n}setComponent(t,e,n){return this.normalized&&(n=this._normalize(n)),this.array[t*this.itemSize+e]=n,this}getX(t){let e=this.array[t*this.itemSize];return this.normalized&&(e=this._denormalize(e)),e}setX(t,e){return this.normalized&&(e=this._normalize(e)),this.array[t*this.itemSize]=e,this}getY(t){let e=this.array[t*this.itemSize+1];return this.normalized&&(e=this._denormalize(e)),e}setY(t,e){return this.normalized&&(e=this._normalize(e)),this.array[t*this.itemSize+1]=e,this}getZ(t){let e=this.array[t*this.itemSize+2];return this.normalized&&(e=this._denormalize(e)),e}setZ(t,e){return this.normalized&&(e=this._normalize(e)),this.array[t*this.itemSize+2]=e,this}getW(t){let e=this.array[t*this.itemSize+3];return this.normalized&&(e=this._denormalize(e)),e}setW(t,e){return this.normalized&&(e=this._normalize(e)),this.array[t*this.itemSize+3]=e,this}setXY(t,e,n){return t*=this.itemSize,this.normalized&&(e=this._normalize(e),n=this._normalize(n)),this.array[t+0]=e,this.array[t+1]=n,this}setXYZ(t,e,n,s){return t*=this.itemSize,this.normalized&&(e=this._normalize(e),n=this._normalize(n),s=this._normalize(s)),this.array[t+0]=e,this.array[t+1]=n,this.array[t+2]=s,this}setXYZW(t,e,n,s,r){return t*=this.itemSize,this.normalized&&(e=this._normalize(e),n=this._normalize(n),s=this._normalize(s),r=this._normalize(r)),this.array[t+0]=e,this.array[t+1]=n,this.array[t+2]=s,this.array[t+3]=r,this}onUpload(t){return this.onUploadCallback=t,this}clone(){return new this.constructor(this.array,this.itemSize).copy(this)}toJSON(){let t={itemSize:this.itemSize,type:this.array.constructor.name,array:Array.from(this.array),normalized:this.normalized};return t.name=this.name,t.usage=this.usage,t.gpuType=this.gpuType,t}dispose(){this.dispatchEvent({type:"dispose"})}_denormalize(t){let e=this._normalizationScale;return e!==void 0?Math.max(t/e,-1):Od(t,this.array)}_normalize(t){let e=this._normalizationScale;return e!==void 0?Math.round(t*e):Fd(t,this.array)}};var Ca=class extends vn{constructor(t,e,n){super(new Uint16Array(t),e,n)}};var Ra=class extends vn{constructor(t,e,n){super(new Uint32Array(t),e,n)}};var sn=class extends vn{constructor(t,e,n){super(new Float32Array(t),e,n)}},Lx=new yi,ga=new k,Wu=new k,Ci=class{constructor(t=new k,e=-1){this.isSphere=!0,this.center=t,this.radius=e}set(t,e){return this.center.copy(t),this.radius=e,this}setFromPoints(t,e){let n=this.center;e!==void 0?n.copy(e):Lx.setFromPoints(t).getCenter(n);let s=0;for(let r=0,o=t.length;r<o;r++)s=Math.max(s,n.distanceToSquared(t[r]));return this.radius=Math.sqrt(s),this}copy(t){return this.center.copy(t.center),this.radius=t.radius,this}isEmpty(){return this.radius<0}makeEmpty(){return this.center.set(0,0,0),this.radius=-1,this}containsPoint(t){return t.distanceToSquared(this.center)<=this.radius*this.radius}distanceToPoint(t){return t.distanceTo(this.center)-this.radius}intersectsSphere(t){let e=this.radius+t.radius;return t.center.distanceToSquared(this.center)<=e*e}intersectsBox(t){return t.intersectsSphere(this)}intersectsPlane(t){return Math.abs(t.distanceToPoint(this.center))<=this.radius}clampPoint(t,e){let n=this.center.distanceToSquared(t);return e.copy(t),n>this.radius*this.radius&&(e.sub(this.center).normalize(),e.multiplyScalar(this.radius).add(this.center)),e}getBoundingBox(t){return this.isEmpty()?(t.makeEmpty(),t):(t.set(this.center,this.center),t.expandByScalar(this.radius),t)}applyMatrix4(t){return this.center.applyMatrix4(t),this.radius=this.radius*t.getMaxScaleOnAxis(),this}translate(t){return this.center.add(t),this}expandByPoint(t){if(this.isEmpty())return this.center.copy(t),this.radius=0,this;ga.subVectors(t,this.center);let e=ga.lengthSq();if(e>this.radius*this.radius){let n=Math.sqrt(e),s=(n-this.radius)*.5;this.center.addScaledVector(ga,s/n),this.radius+=s}return this}union(t){return t.isEmpty()?this:this.isEmpty()?(this.copy(t),this):(this.center.equals(t.center)===!0?this.radius=Math.max(this.radius,t.radius):(Wu.subVectors(t.center,this.center).setLength(t.radius),this.expandByPoint(ga.copy(t.center).add(Wu)),this.expandByPoint(ga.copy(t.center).sub(Wu))),this)}equals(t){return t.center.equals(this.center)&&t.radius===this.radius}clone(){return new this.constructor().copy(this)}toJSON(){return{radius:this.radius,center:this.center.toArray()}}fromJSON(t){return this.radius=t.radius,this.center.fromArray(t.center),this}},Dx=0,Ai=new be,Xu=new Un,po=new k,gi=new yi,_a=new yi,Dn=new k,gn=class i extends zi{constructor(){super(),this.isBufferGeometry=!0,Object.defineProperty(this,"id",{value:Dx++}),this.uuid=hr(),this.name="",this.type="BufferGeometry",this.index=null,this.indirect=null,this.indirectOffset=0,this.attributes={},this.morphAttributes={},this.morphTargetsRelative=!1,this.groups=[],this.boundingBox=null,this.boundingSphere=null,this.drawRange={start:0,count:1/0},this.userData={},this._transformed=!1}getIndex(){return this.index}setIndex(t){return Array.isArray(t)?this.index=new(sx(t)?Ra:Ca)(t,1):this.index=t,this}setIndirect(t,e=0){return this.indirect=t,this.indirectOffset=e,this}getIndirect(){return this.indirect}getAttribute(t){return this.attributes[t]}setAttribute(t,e){return this.attributes[t]=e,this}deleteAttribute(t){return delete this.attributes[t],this}hasAttribute(t){return this.attributes[t]!==void 0}addGroup(t,e,n=0){this.groups.push({start:t,count:e,materialIndex:n})}clearGroups(){this.groups=[]}setDrawRange(t,e){this.drawRange.start=t,this.drawRange.count=e}applyMatrix4(t){let e=this.attributes.position;e!==void 0&&(e.applyMatrix4(t),e.needsUpdate=!0);let n=this.attributes.normal;if(n!==void 0){let r=new ie().getNormalMatrix(t);n.applyNormalMatrix(r),n.needsUpdate=!0}let s=this.attributes.tangent;return s!==void 0&&(s.transformDirection(t),s.needsUpdate=!0),this.boundingBox!==null&&this.computeBoundingBox(),this.boundingSphere!==null&&this.computeBoundingSphere(),this._transformed=!0,this}applyQuaternion(t){return Ai.makeRotationFromQuaternion(t),this.applyMatrix4(Ai),this}rotateX(t){return Ai.makeRotationX(t),this.applyMatrix4(Ai),this}rotateY(t){return Ai.makeRotationY(t),this.applyMatrix4(Ai),this}rotateZ(t){return Ai.makeRotationZ(t),this.applyMatrix4(Ai),this}translate(t,e,n){return Ai.makeTranslation(t,e,n),this.applyMatrix4(Ai),this}scale(t,e,n){return Ai.makeScale(t,e,n),this.applyMatrix4(Ai),this}lookAt(t){return Xu.lookAt(t),Xu.updateMatrix(),this.applyMatrix4(Xu.matrix),this}center(){return this.computeBoundingBox(),this.boundingBox.getCenter(po).negate(),this.translate(po.x,po.y,po.z),this}setFromPoints(t){let e=this.getAttribute("position");if(e===void 0){let n=[];for(let s=0,r=t.length;s<r;s++){let o=t[s];n.push(o.x,o.y,o.z||0)}this.setAttribute("position",new sn(n,3))}else{let n=Math.min(t.length,e.count);for(let s=0;s<n;s++){let r=t[s];e.setXYZ(s,r.x,r.y,r.z||0)}t.length>e.count&&$t("BufferGeometry: Buffer size too small for points data. Use .dispose() and create a new geometry."),e.needsUpdate=!0}return this}computeBoundingBox(){this.boundingBox===null&&(this.boundingBox=new yi);let t=this.attributes.position,e=this.morphAttributes.position;if(t&&t.isGLBufferAttribute){ee("BufferGeometry.computeBoundingBox(): GLBufferAttribute requires a manual bounding box.",this),this.boundingBox.set(new k(-1/0,-1/0,-1/0),new k(1/0,1/0,1/0));return}if(t!==void 0){if(this.boundingBox.setFromBufferAttribute(t),e)for(let n=0,s=e.length;n<s;n++){let r=e[n];gi.setFromBufferAttribute(r),this.morphTargetsRelative?(Dn.addVectors(this.boundingBox.min,gi.min),this.boundingBox.expandByPoint(Dn),Dn.addVectors(this.boundingBox.max,gi.max),this.boundingBox.expandByPoint(Dn)):(this.boundingBox.expandByPoint(gi.min),this.boundingBox.expandByPoint(gi.max))}}else this.boundingBox.makeEmpty();(isNaN(this.boundingBox.min.x)||isNaN(this.boundingBox.min.y)||isNaN(this.boundingBox.min.z))&&ee('BufferGeometry.computeBoundingBox(): Computed min/max have NaN values. The "position" attribute is likely to have NaN values.',this)}computeBoundingSphere(){this.boundingSphere===null&&(this.boundingSphere=new Ci);let t=this.attributes.position,e=this.morphAttributes.position;if(t&&t.isGLBufferAttribute){ee("BufferGeometry.computeBoundingSphere(): GLBufferAttribute requires a manual bounding sphere.",this),this.boundingSphere.set(new k,1/0);return}if(t){let n=this.boundingSphere.center;if(gi.setFromBufferAttribute(t),e)for(let r=0,o=e.length;r<o;r++){let a=e[r];_a.setFromBufferAttribute(a),this.morphTargetsRelative?(Dn.addVectors(gi.min,_a.min),gi.expandByPoint(Dn),Dn.addVectors(gi.max,_a.max),gi.expandByPoint(Dn)):(gi.expandByPoint(_a.min),gi.expandByPoint(_a.max))}gi.getCenter(n);let s=0;for(let r=0,o=t.count;r<o;r++)Dn.fromBufferAttribute(t,r),s=Math.max(s,n.distanceToSquared(Dn));if(e)for(let r=0,o=e.length;r<o;r++){let a=e[r],l=this.morphTargetsRelative;for(let c=0,u=a.count;c<u;c++)Dn.fromBufferAttribute(a,c),l&&(po.fromBufferAttribute(t,c),Dn.add(po)),s=Math.max(s,n.distanceToSquared(Dn))}this.boundingSphere.radius=Math.sqrt(s),isNaN(this.boundingSphere.radius)&&ee('BufferGeometry.computeBoundingSphere(): Computed radius is NaN. The "position" attribute is likely to have NaN values.',this)}}computeTangents(){let t=this.index,e=this.attributes;if(t===null||e.position===void 0||e.normal===void 0||e.uv===void 0){ee("BufferGeometry: .computeTangents() failed. Missing required attributes (index, position, normal or uv)");return}let n=e.position,s=e.normal,r=e.uv,o=this.getAttribute("tangent");(o===void 0||o.count!==n.count)&&(o=new vn(new Float32Array(4*n.count),4),this.setAttribute("tangent",o));let a=[],l=[],c=new Uint8Array(n.count);for(let V=0;V<n.count;V++)a[V]=new k,l[V]=new k;let u=new k,h=new k,d=new k,f=new Zt,m=new Zt,y=new Zt,p=new k,g=new k;function v(V,N,L){c[V]=c[N]=c[L]=1,u.fromBufferAttribute(n,V),h.fromBufferAttribute(n,N),d.fromBufferAttribute(n,L),f.fromBufferAttribute(r,V),m.fromBufferAttribute(r,N),y.fromBufferAttribute(r,L),h.sub(u),d.sub(u),m.sub(f),y.sub(f);let X=1/(m.x*y.y-y.x*m.y);isFinite(X)&&(p.copy(h).multiplyScalar(y.y).addScaledVector(d,-m.y).multiplyScalar(X),g.copy(d).multiplyScalar(m.x).addScaledVector(h,-y.x).multiplyScalar(X),a[V].add(p),a[N].add(p),a[L].add(p),l[V].add(g),l[N].add(g),l[L].add(g))}let E=this.groups;E.length===0&&(E=[{start:0,count:t.count}]);for(let V=0,N=E.length;V<N;++V){let L=E[V],X=L.start,q=L.count;for(let D=X,W=X+q;D<W;D+=3)v(t.getX(D+0),t.getX(D+1),t.getX(D+2))}let b=new k,I=new k,A=new k,x=new k;function T(V){A.fromBufferAttribute(s,V),x.copy(A);let N=a[V];b.copy(N),b.sub(A.multiplyScalar(A.dot(N))).normalize(),I.crossVectors(x,N);let X=I.dot(l[V])<0?-1:1;o.setXYZW(V,b.x,b.y,b.z,X)}for(let V=0,N=n.count;V<N;++V)c[V]&&T(V);this._transformed=!0}computeVertexNormals(){let t=this.index,e=this.getAttribute("position");if(e!==void 0){let n=this.getAttribute("normal");if(n===void 0||n.count!==e.count)n=new vn(new Float32Array(e.count*3),3),this.setAttribute("normal",n);else for(let d=0,f=n.count;d<f;d++)n.setXYZ(d,0,0,0);let s=new k,r=new k,o=new k,a=new k,l=new k,c=new k,u=new k,h=new k;if(t)for(let d=0,f=t.count;d<f;d+=3){let m=t.getX(d+0),y=t.getX(d+1),p=t.getX(d+2);s.fromBufferAttribute(e,m),r.fromBufferAttribute(e,y),o.fromBufferAttribute(e,p),u.subVectors(o,r),h.subVectors(s,r),u.cross(h),a.fromBufferAttribute(n,m),l.fromBufferAttribute(n,y),c.fromBufferAttribute(n,p),a.add(u),l.add(u),c.add(u),n.setXYZ(m,a.x,a.y,a.z),n.setXYZ(y,l.x,l.y,l.z),n.setXYZ(p,c.x,c.y,c.z)}else for(let d=0,f=e.count;d<f;d+=3)s.fromBufferAttribute(e,d+0),r.fromBufferAttribute(e,d+1),o.fromBufferAttribute(e,d+2),u.subVectors(o,r),h.subVectors(s,r),u.cross(h),n.setXYZ(d+0,u.x,u.y,u.z),n.setXYZ(d+1,u.x,u.y,u.z),n.setXYZ(d+2,u.x,u.y,u.z);this.normalizeNormals(),n.needsUpdate=!0}}normalizeNormals(){let t=this.attributes.normal;for(let e=0,n=t.count;e<n;e++)Dn.fromBufferAttribute(t,e),Dn.normalize(),t.setXYZ(e,Dn.x,Dn.y,Dn.z)}toNonIndexed(){function t(a,l){let c=a.array,u=a.itemSize,h=a.normalized,d=new c.constructor(l.length*u),f=0,m=0;for(let y=0,p=l.length;y<p;y++){a.isInterleavedBufferAttribute?f=l[y]*a.data.stride+a.offset:f=l[y]*u;for(let g=0;g<u;g++)d[m++]=c[f++]}return new vn(d,u,h)}if(this.index===null)return $t("BufferGeometry.toNonIndexed(): BufferGeometry is already non-indexed."),this;let e=new i,n=this.index.array,s=this.attributes;for(let a in s){let l=s[a],c=t(l,n);e.setAttribute(a,c)}let r=this.morphAttributes;for(let a in r){let l=[],c=r[a];for(let u=0,h=c.length;u<h;u++){let d=c[u],f=t(d,n);l.push(f)}e.morphAttributes[a]=l}e.morphTargetsRelative=this.morphTargetsRelative;let o=this.groups;for(let a=0,l=o.length;a<l;a++){let c=o[a];e.addGroup(c.start,c.count,c.materialIndex)}return e}toJSON(){let t={metadata:{version:4.7,type:"BufferGeometry",generator:"BufferGeometry.toJSON"}};if(t.uuid=this.uuid,t.type=this.parameters!==void 0&&this._transformed===!0?"BufferGeometry":this.type,t.name=this.name,Object.keys(this.userData).length>0&&(t.userData=this.userData),this.parameters!==void 0&&this._transformed!==!0){let l=this.parameters;for(let c in l)l[c]!==void 0&&(t[c]=l[c]);return t}t.data={attributes:{}};let e=this.index;e!==null&&(t.data.index={type:e.array.constructor.name,array:Array.prototype.slice.call(e.array)});let n=this.attributes;for(let l in n){let c=n[l];t.data.attributes[l]=c.toJSON(t.data)}let s={},r=!1;for(let l in this.morphAttributes){let c=this.morphAttributes[l],u=[];for(let h=0,d=c.length;h<d;h++){let f=c[h];u.push(f.toJSON(t.data))}u.length>0&&(s[l]=u,r=!0)}r&&(t.data.morphAttributes=s,t.data.morphTargetsRelative=this.morphTargetsRelative);let o=this.groups;o.length>0&&(t.data.groups=JSON.parse(JSON.stringify(o)));let a=this.boundingSphere;return a!==null&&(t.data.boundingSphere=a.toJSON()),t}clone(){return new this.constructor().copy(this)}copy(t){this.index=null,this.attributes={},this.morphAttributes={},this.groups=[],this.boundingBox=null,this.boundingSphere=null;let e={};this.name=t.name;let n=t.index;n!==null&&this.setIndex(n.clone());let s=t.attributes;for(let c in s){let u=s[c];this.setAttribute(c,u.clone(e))}let r=t.morphAttributes;for(let c in r){let u=[],h=r[c];for(let d=0,f=h.length;d<f;d++)u.push(h[d].clone(e));this.morphAttributes[c]=u}this.morphTargetsRelative=t.morphTargetsRelative;let o=t.groups;for(let c=0,u=o.length;c<u;c++){let h=o[c];this.addGroup(h.start,h.count,h.materialIndex)}let a=t.boundingBox;a!==null&&(this.boundingBox=a.clone());let l=t.boundingSphere;return l!==null&&(this.boundingSphere=l.clone()),this.drawRange.start=t.drawRange.start,this.drawRange.count=t.drawRange.count,this.userData=t.userData,this._transformed=t._transformed,this}dispose(){this.dispatchEvent({type:"dispose"})}},Sc=class{constructor(t,e){this.isInterleavedBuffer=!0,this.array=t,this.stride=e,this.count=t!==void 0?t.length/e:0,this.usage=Ld,this.updateRanges=[],this.version=0,this.uuid=hr()}onUploadCallback(){}set needsUpdate(t){t===!0&&this.version++}setUsage(t){return this.usage=t,this}addUpdateRange(t,e){this.updateRanges.push({start:t,count:e})}clearUpdateRanges(){this.updateRanges.length=0}copy(t){return this.array=new t.array.constructor(t.array),this.count=t.count,this.stride=t.stride,this.usage=t.usage,this}copyAt(t,e,n){t*=this.stride,n*=e.stride;for(let s=0,r=this.stride;s<r;s++)this.array[t+s]=e.array[n+s];return this}set(t,e=0){return this.array.set(t,e),this}clone(t){t.arrayBuffers===void 0&&(t.arrayBuffers={});let e=kp(this.array);t.arrayBuffers[e]===void 0&&(t.arrayBuffers[e]=this.array.slice(0).buffer);let n=new this.array.constructor(t.arrayBuffers[e]),s=new this.constructor(n,this.stride);return s.setUsage(this.usage),s}onUpload(t){return this.onUploadCallback=t,this}toJSON(t){t.arrayBuffers===void 0&&(t.arrayBuffers={});let e=kp(this.array);t.arrayBuffers[e]===void 0&&(t.arrayBuffers[e]=Array.from(new Uint32Array(this.array.slice(0).buffer)));let n={uuid:this.uuid,buffer:e,type:this.array.constructor.name,stride:this.stride};return n.usage=this.usage,n}};function kp(i){return i.buffer._uuid===void 0&&(i.buffer._uuid=hr()),i.byteOffset===0&&i.byteLength===i.buffer.byteLength?i.buffer._uuid:i.buffer._uuid+":"+i.byteOffset+":"+i.byteLength}var Jn=new k,Vi=class i{constructor(t,e,n,s=!1){this.isInterleavedBufferAttribute=!0,this.name="",this.data=t,this.itemSize=e,this.offset=n,this.normalized=s,this._normalizationScale=t!==void 0?Ch(t.array):void 0}get count(){return this.data.count}get array(){return this.data.array}set needsUpdate(t){this.data.needsUpdate=t}applyMatrix4(t){for(let e=0,n=this.data.count;e<n;e++)Jn.fromBufferAttribute(this,e),Jn.applyMatrix4(t),this.setXYZ(e,Jn.x,Jn.y,Jn.z);return this}applyNormalMatrix(t){for(let e=0,n=this.count;e<n;e++)Jn.fromBufferAttribute(this,e),Jn.applyNormalMatrix(t),this.setXYZ(e,Jn.x,Jn.y,Jn.z);return this}transformDirection(t){for(let e=0,n=this.count;e<n;e++)Jn.fromBufferAttribute(this,e),Jn.transformDirection(t),this.setXYZ(e,Jn.x,Jn.y,Jn.z);return this}getComponent(t,e){let n=this.array[t*this.data.stride+this.offset+e];return this.normalized&&(n=this._denormalize(n)),n}setComponent(t,e,n){return this.normalized&&(n=this._normalize(n)),this.data.array[t*this.data.stride+this.offset+e]=n,this}setX(t,e){return this.normalized&&(e=this._normalize(e)),this.data.array[t*this.data.stride+this.offset]=e,this}setY(t,e){return this.normalized&&(e=this._normalize(e)),this.data.array[t*this.data.stride+this.offset+1]=e,this}setZ(t,e){return this.normalized&&(e=this._normalize(e)),this.data.array[t*this.data.stride+this.offset+2]=e,this}setW(t,e){return this.normalized&&(e=this._normalize(e)),this.data.array[t*this.data.stride+this.offset+3]=e,this}getX(t){let e=this.data.array[t*this.data.stride+this.offset];return this.normalized&&(e=this._denormalize(e)),e}getY(t){let e=this.data.array[t*this.data.stride+this.offset+1];return this.normalized&&(e=this._denormalize(e)),e}getZ(t){let e=this.data.array[t*this.data.stride+this.offset+2];return this.normalized&&(e=this._denormalize(e)),e}getW(t){let e=this.data.array[t*this.data.stride+this.offset+3];return this.normalized&&(e=this._denormalize(e)),e}setXY(t,e,n){return t=t*this.data.stride+this.offset,this.normalized&&(e=this._normalize(e),n=this._normalize(n)),this.data.array[t+0]=e,this.data.array[t+1]=n,this}setXYZ(t,e,n,s){return t=t*this.data.stride+this.offset,this.normalized&&(e=this._normalize(e),n=this._normalize(n),s=this._normalize(s)),this.data.array[t+0]=e,this.data.array[t+1]=n,this.data.array[t+2]=s,this}setXYZW(t,e,n,s,r){return t=t*this.data.stride+this.offset,this.normalized&&(e=this._normalize(e),n=this._normalize(n),s=this._normalize(s),r=this._normalize(r)),this.data.array[t+0]=e,this.data.array[t+1]=n,this.data.array[t+2]=s,this.data.array[t+3]=r,this}clone(t){if(t===void 0){Ta("InterleavedBufferAttribute.clone(): Cloning an interleaved buffer attribute will de-interleave buffer data.");let e=[];for(let n=0;n<this.count;n++){let s=n*this.data.stride+this.offset;for(let r=0;r<this.itemSize;r++)e.push(this.data.array[s+r])}return new vn(new this.array.constructor(e),this.itemSize,this.normalized)}else return t.interleavedBuffers===void 0&&(t.interleavedBuffers={}),t.interleavedBuffers[this.data.uuid]===void 0&&(t.interleavedBuffers[this.data.uuid]=this.data.clone(t)),new i(t.interleavedBuffers[this.data.uuid],this.itemSize,this.offset,this.normalized)}toJSON(t){if(t===void 0){Ta("InterleavedBufferAttribute.toJSON(): Serializing an interleaved buffer attribute will de-interleave buffer data.");let e=[];for(let n=0;n<this.count;n++){let s=n*this.data.stride+this.offset;for(let r=0;r<this.itemSize;r++)e.push(this.data.array[s+r])}return{itemSize:this.itemSize,type:this.array.constructor.name,array:e,normalized:this.normalized}}else return t.interleavedBuffers===void 0&&(t.interleavedBuffers={}),t.interleavedBuffers[this.data.uuid]===void 0&&(t.interleavedBuffers[this.data.uuid]=this.data.toJSON(t)),{isInterleavedBufferAttribute:!0,itemSize:this.itemSize,data:this.data.uuid,offset:this.offset,normalized:this.normalized}}_denormalize(t){let e=this._normalizationScale;return e!==void 0?Math.max(t/e,-1):Od(t,this.data.array)}_normalize(t){let e=this._normalizationScale;return e!==void 0?Math.round(t*e):Fd(t,this.data.array)}},qu=new k,Nx=new k,Ux=new ie,_i=class{constructor(t=new k(1,0,0),e=0){this.isPlane=!0,this.normal=t,this.constant=e}set(t,e){return this.normal.copy(t),this.constant=e,this}setComponents(t,e,n,s){return this.normal.set(t,e,n),this.constant=s,this}setFromNormalAndCoplanarPoint(t,e){return this.normal.copy(t),this.constant=-e.dot(this.normal),this}setFromCoplanarPoints(t,e,n){let s=qu.subVectors(n,e).cross(Nx.subVectors(t,e)).normalize();return this.setFromNormalAndCoplanarPoint(s,t),this}copy(t){return this.normal.copy(t.normal),this.constant=t.constant,this}normalize(){let t=1/this.normal.length();return this.normal.multiplyScalar(t),this.constant*=t,this}negate(){return this.constant*=-1,this.normal.negate(),this}distanceToPoint(t){return this.normal.dot(t)+this.constant}distanceToSphere(t){return this.distanceToPoint(t.center)-t.radius}projectPoint(t,e){return e.copy(t).addScaledVector(this.normal,-this.distanceToPoint(t))}intersectLine(t,e,n=!0){let s=t.delta(qu),r=this.normal.dot(s);if(r===0)return this.distanceToPoint(t.start)===0?e.copy(t.start):null;let o=-(t.start.dot(this.normal)+this.constant)/r;return n===!0&&(o<0||o>1)?null:e.copy(t.start).addScaledVector(s,o)}intersectsLine(t){let e=this.distanceToPoint(t.start),n=this.distanceToPoint(t.end);return e<0&&n>0||n<0&&e>0}intersectsBox(t){return t.intersectsPlane(this)}intersectsSphere(t){return t.intersectsPlane(this)}coplanarPoint(t){return t.copy(this.normal).multiplyScalar(-this.constant)}applyMatrix4(t,e){let n=e||Ux.getNormalMatrix(t),s=this.coplanarPoint(qu).applyMatrix4(t),r=this.normal.applyMatrix3(n).normalize();return this.constant=-s.dot(r),this}translate(t){return this.constant-=t.dot(this.normal),this}equals(t){return t.normal.equals(this.normal)&&t.constant===this.constant}clone(){return new this.constructor().copy(this)}toJSON(){return{normal:this.normal.toArray(),constant:this.constant}}fromJSON(t){return this.normal.fromArray(t.normal),this.constant=t.constant,this}},Ox=0,cs=class extends zi{constructor(){super(),this.isMaterial=!0,Object.defineProperty(this,"id",{value:Ox++}),this.uuid=hr(),this.name="",this.type="Material",this.blending=Bo,this.side=lr,this.vertexColors=!1,this.opacity=1,this.transparent=!1,this.alphaHash=!1,this.blendSrc=dd,this.blendDst=fd,this.blendEquation=Er,this.blendSrcAlpha=null,this.blendDstAlpha=null,this.blendEquationAlpha=null,this.blendColor=new he(0,0,0),this.blendAlpha=0,this.depthFunc=bo,this.depthTest=!0,this.depthWrite=!0,this.stencilWriteMask=255,this.stencilFunc=Dm,this.stencilRef=0,this.stencilFuncMask=255,this.stencilFail=ac,this.stencilZFail=ac,this.stencilZPass=ac,this.stencilWrite=!1,this.clippingPlanes=null,this.clipIntersection=!1,this.clipShadows=!1,this.shadowSide=null,this.colorWrite=!0,this.precision=null,this.polygonOffset=!1,this.polygonOffsetFactor=0,this.polygonOffsetUnits=0,this.dithering=!1,this.alphaToCoverage=!1,this.premultipliedAlpha=!1,this.forceSinglePass=!1,this.allowOverride=!0,this.visible=!0,this.toneMapped=!0,this.userData={},this.version=0,this._alphaTest=0}get alphaTest(){return this._alphaTest}set alphaTest(t){this._alphaTest>0!=t>0&&this.version++,this._alphaTest=t}onBeforeRender(){}onBeforeCompile(){}customProgramCacheKey(){return this.onBeforeCompile.toString()}setValues(t){if(t!==void 0)for(let e in t){let n=t[e];if(n===void 0){$t(`Material: parameter '${e}' has value of undefined.`);continue}let s=this[e];if(s===void 0){$t(`Material: '${e}' is not a property of THREE.${this.type}.`);continue}s&&s.isColor?s.set(n):s&&s.isVector2&&n&&n.isVector2||s&&s.isEuler&&n&&n.isEuler||s&&s.isVector3&&n&&n.isVector3?s.copy(n):this[e]=n}}toJSON(t){let e=t===void 0||typeof t=="string";e&&(t={textures:{},images:{}});let n={metadata:{version:4.7,type:"Material",generator:"Material.toJSON"}};n.uuid=this.uuid,n.type=this.type,n.blending=this.blending,n.side=this.side,n.shadowSide=this.shadowSide,n.vertexColors=this.vertexColors,n.opacity=this.opacity,n.transparent=this.transparent,n.blendSrc=this.blendSrc,n.blendDst=this.blendDst,n.blendEquation=this.blendEquation,n.blendSrcAlpha=this.blendSrcAlpha,n.blendDstAlpha=this.blendDstAlpha,n.blendEquationAlpha=this.blendEquationAlpha,n.blendColor=this.blendColor.getHex(),n.blendAlpha=this.blendAlpha,n.depthFunc=this.depthFunc,n.depthTest=this.depthTest,n.depthWrite=this.depthWrite,n.colorWrite=this.colorWrite,n.clipIntersection=this.clipIntersection,n.clipShadows=this.clipShadows,n.stencilWriteMask=this.stencilWriteMask,n.stencilFunc=this.stencilFunc,n.stencilRef=this.stencilRef,n.stencilFuncMask=this.stencilFuncMask,n.stencilFail=this.stencilFail,n.stencilZFail=this.stencilZFail,n.stencilZPass=this.stencilZPass,n.stencilWrite=this.stencilWrite,n.polygonOffset=this.polygonOffset,n.polygonOffsetFactor=this.polygonOffsetFactor,n.polygonOffsetUnits=this.polygonOffsetUnits,n.dithering=this.dithering,n.alphaTest=this.alphaTest,n.alphaHash=this.alphaHash,n.alphaToCoverage=this.alphaToCoverage,n.premultipliedAlpha=this.premultipliedAlpha,n.forceSinglePass=this.forceSinglePass,n.allowOverride=this.allowOverride,n.visible=this.visible,n.toneMapped=this.toneMapped,n.name=this.name,this.color&&this.color.isColor&&(n.color=this.color.getHex()),this.roughness!==void 0&&(n.roughness=this.roughness),this.metalness!==void 0&&(n.metalness=this.metalness),this.sheen!==void 0&&(n.sheen=this.sheen),this.sheenColor&&this.sheenColor.isColor&&(n.sheenColor=this.sheenColor.getHex()),this.sheenRoughness!==void 0&&(n.sheenRoughness=this.sheenRoughness),this.emissive&&this.emissive.isColor&&(n.emissive=this.emissive.getHex()),this.emissiveIntensity!==void 0&&(n.emissiveIntensity=this.emissiveIntensity),this.specular&&this.specular.isColor&&(n.specular=this.specular.getHex()),this.specularIntensity!==void 0&&(n.specularIntensity=this.specularIntensity),this.specularColor&&this.specularColor.isColor&&(n.specularColor=this.specularColor.getHex()),this.shininess!==void 0&&(n.shininess=this.shininess),this.clearcoat!==void 0&&(n.clearcoat=this.clearcoat),this.clearcoatRoughness!==void 0&&(n.clearcoatRoughness=this.clearcoatRoughness),this.diffuseRoughness!==void 0&&(n.diffuseRoughness=this.diffuseRoughness),this.diffuseRoughnessMap&&this.diffuseRoughnessMap.isTexture&&(n.diffuseRoughnessMap=this.diffuseRoughnessMap.toJSON(t).uuid),this.clearcoatMap&&this.clearcoatMap.isTexture&&(n.clearcoatMap=this.clearcoatMap.toJSON(t).uuid),this.clearcoatRoughnessMap&&this.clearcoatRoughnessMap.isTexture&&(n.clearcoatRoughnessMap=this.clearcoatRoughnessMap.toJSON(t).uuid),this.clearcoatNormalMap&&this.clearcoatNormalMap.isTexture&&(n.clearcoatNormalMap=this.clearcoatNormalMap.toJSON(t).uuid,n.clearcoatNormalScale=this.clearcoatNormalScale.toArray()),this.sheenColorMap&&this.sheenColorMap.isTexture&&(n.sheenColorMap=this.sheenColorMap.toJSON(t).uuid),this.sheenRoughnessMap&&this.sheenRoughnessMap.isTexture&&(n.sheenRoughnessMap=this.sheenRoughnessMap.toJSON(t).uuid),this.dispersion!==void 0&&(n.dispersion=this.dispersion),this.retroreflectivity!==void 0&&(n.retroreflectivity=this.retroreflectivity),this.iridescence!==void 0&&(n.iridescence=this.iridescence),this.iridescenceIOR!==void 0&&(n.iridescenceIOR=this.iridescenceIOR),this.iridescenceThicknessMinimum!==void 0&&(n.iridescenceThicknessMinimum=this.iridescenceThicknessMinimum),this.iridescenceThicknessMaximum!==void 0&&(n.iridescenceThicknessMaximum=this.iridescenceThicknessMaximum),this.iridescenceMap&&this.iridescenceMap.isTexture&&(n.iridescenceMap=this.iridescenceMap.toJSON(t).uuid),this.iridescenceThicknessMap&&this.iridescenceThicknessMap.isTexture&&(n.iridescenceThicknessMap=this.iridescenceThicknessMap.toJSON(t).uuid),this.anisotropy!==void 0&&(n.anisotropy=this.anisotropy),this.anisotropyRotation!==void 0&&(n.anisotropyRotation=this.anisotropyRotation),this.anisotropyMap&&this.anisotropyMap.isTexture&&(n.anisotropyMap=this.anisotropyMap.toJSON(t).uuid),this.map&&this.map.isTexture&&(n.map=this.map.toJSON(t).uuid),this.matcap&&this.matcap.isTexture&&(n.matcap=this.matcap.toJSON(t).uuid),this.alphaMap&&this.alphaMap.isTexture&&(n.alphaMap=this.alphaMap.toJSON(t).uuid),this.lightMap&&this.lightMap.isTexture&&(n.lightMap=this.lightMap.toJSON(t).uuid,n.lightMapIntensity=this.lightMapIntensity),this.aoMap&&this.aoMap.isTexture&&(n.aoMap=this.aoMap.toJSON(t).uuid,n.aoMapIntensity=this.aoMapIntensity),this.bumpMap&&this.bumpMap.isTexture&&(n.bumpMap=this.bumpMap.toJSON(t).uuid,n.bumpScale=this.bumpScale),this.normalMap&&this.normalMap.isTexture&&(n.normalMap=this.normalMap.toJSON(t).uuid,n.normalMapType=this.normalMapType,n.normalScale=this.normalScale.toArray()),this.displacementMap&&this.displacementMap.isTexture&&(n.displacementMap=this.displacementMap.toJSON(t).uuid,n.displacementScale=this.displacementScale,n.displacementBias=this.displacementBias),this.roughnessMap&&this.roughnessMap.isTexture&&(n.roughnessMap=this.roughnessMap.toJSON(t).uuid),this.metalnessMap&&this.metalnessMap.isTexture&&(n.metalnessMap=this.metalnessMap.toJSON(t).uuid),this.emissiveMap&&this.emissiveMap.isTexture&&(n.emissiveMap=this.emissiveMap.toJSON(t).uuid),this.specularMap&&this.specularMap.isTexture&&(n.specularMap=this.specularMap.toJSON(t).uuid),this.specularIntensityMap&&this.specularIntensityMap.isTexture&&(n.specularIntensityMap=this.specularIntensityMap.toJSON(t).uuid),this.specularColorMap&&this.specularColorMap.isTexture&&(n.specularColorMap=this.specularColorMap.toJSON(t).uuid),this.envMap&&this.envMap.isTexture&&(n.envMap=this.envMap.toJSON(t).uuid,this.combine!==void 0&&(n.combine=this.combine)),this.envMapRotation!==void 0&&(n.envMapRotation=this.envMapRotation.toArray()),this.envMapIntensity!==void 0&&(n.envMapIntensity=this.envMapIntensity),this.reflectivity!==void 0&&(n.reflectivity=this.reflectivity),this.refractionRatio!==void 0&&(n.refractionRatio=this.refractionRatio),this.gradientMap&&this.gradientMap.isTexture&&(n.gradientMap=this.gradientMap.toJSON(t).uuid),this.transmission!==void 0&&(n.transmission=this.transmission),this.transmissionMap&&this.transmissionMap.isTexture&&(n.transmissionMap=this.transmissionMap.toJSON(t).uuid),this.thickness!==void 0&&(n.thickness=this.thickness),this.thicknessMap&&this.thicknessMap.isTexture&&(n.thicknessMap=this.thicknessMap.toJSON(t).uuid),this.attenuationDistance!==void 0&&(n.attenuationDistance=this.attenuationDistance),this.attenuationColor!==void 0&&(n.attenuationColor=this.attenuationColor.getHex()),this.size!==void 0&&(n.size=this.size),this.sizeAttenuation!==void 0&&(n.sizeAttenuation=this.sizeAttenuation),Array.isArray(this.clippingPlanes)&&this.clippingPlanes.length>0&&(n.clippingPlanes=this.clippingPlanes.map(r=>r.toJSON())),this.rotation!==void 0&&(n.rotation=this.rotation),this.depthPacking!==void 0&&(n.depthPacking=this.depthPacking),this.linewidth!==void 0&&(n.linewidth=this.linewidth),this.linecap!==void 0&&(n.linecap=this.linecap),this.linejoin!==void 0&&(n.linejoin=this.linejoin),this.dashSize!==void 0&&(n.dashSize=this.dashSize),this.gapSize!==void 0&&(n.gapSize=this.gapSize),this.scale!==void 0&&(n.scale=this.scale),this.wireframe!==void 0&&(n.wireframe=this.wireframe),this.wireframeLinewidth!==void 0&&(n.wireframeLinewidth=this.wireframeLinewidth),this.wireframeLinecap!==void 0&&(n.wireframeLinecap=this.wireframeLinecap),this.wireframeLinejoin!==void 0&&(n.wireframeLinejoin=this.wireframeLinejoin),this.flatShading!==void 0&&(n.flatShading=this.flatShading),this.fog!==void 0&&(n.fog=this.fog),Object.keys(this.userData).length>0&&(n.userData=this.userData);function s(r){let o=[];for(let a in r){let l=r[a];delete l.metadata,o.push(l)}return o}if(e){let r=s(t.textures),o=s(t.images);r.length>0&&(n.textures=r),o.length>0&&(n.images=o)}return n}fromJSON(t,e){if(t.uuid!==void 0&&(this.uuid=t.uuid),t.name!==void 0&&(this.name=t.name),t.color!==void 0&&this.color!==void 0&&this.color.setHex(t.color),t.roughness!==void 0&&(this.roughness=t.roughness),t.metalness!==void 0&&(this.metalness=t.metalness),t.sheen!==void 0&&(this.sheen=t.sheen),t.sheenColor!==void 0&&(this.sheenColor=new he().setHex(t.sheenColor)),t.sheenRoughness!==void 0&&(this.sheenRoughness=t.sheenRoughness),t.emissive!==void 0&&this.emissive!==void 0&&this.emissive.setHex(t.emissive),t.specular!==void 0&&this.specular!==void 0&&this.specular.setHex(t.specular),t.specularIntensity!==void 0&&(this.specularIntensity=t.specularIntensity),t.specularColor!==void 0&&this.specularColor!==void 0&&this.specularColor.setHex(t.specularColor),t.shininess!==void 0&&(this.shininess=t.shininess),t.clearcoat!==void 0&&(this.clearcoat=t.clearcoat),t.clearcoatRoughness!==void 0&&(this.clearcoatRoughness=t.clearcoatRoughness),t.diffuseRoughness!==void 0&&(this.diffuseRoughness=t.diffuseRoughness),t.dispersion!==void 0&&(this.dispersion=t.dispersion),t.retroreflectivity!==void 0&&(this.retroreflectivity=t.retroreflectivity),t.iridescence!==void 0&&(this.iridescence=t.iridescence),t.iridescenceIOR!==void 0&&(this.iridescenceIOR=t.iridescenceIOR),t.iridescenceThicknessMinimum!==void 0&&(this.iridescenceThicknessMinimum=t.iridescenceThicknessMinimum),t.iridescenceThicknessMaximum!==void 0&&(this.iridescenceThicknessMaximum=t.iridescenceThicknessMaximum),t.iridescenceThicknessRange!==void 0&&(this.iridescenceThicknessMinimum=t.iridescenceThicknessRange[0],this.iridescenceThicknessMaximum=t.iridescenceThicknessRange[1]),t.transmission!==void 0&&(this.transmission=t.transmission),t.thickness!==void 0&&(this.thickness=t.thickness),t.attenuationDistance!==void 0&&(this.attenuationDistance=t.attenuationDistance),t.attenuationColor!==void 0&&this.attenuationColor!==void 0&&this.attenuationColor.setHex(t.attenuationColor),t.anisotropy!==void 0&&(this.anisotropy=t.anisotropy),t.anisotropyRotation!==void 0&&(this.anisotropyRotation=t.anisotropyRotation),t.fog!==void 0&&(this.fog=t.fog),t.flatShading!==void 0&&(this.flatShading=t.flatShading),t.blending!==void 0&&(this.blending=t.blending),t.combine!==void 0&&(this.combine=t.combine),t.side!==void 0&&(this.side=t.side),t.shadowSide!==void 0&&(this.shadowSide=t.shadowSide),t.opacity!==void 0&&(this.opacity=t.opacity),t.transparent!==void 0&&(this.transparent=t.transparent),t.alphaTest!==void 0&&(this.alphaTest=t.alphaTest),t.alphaHash!==void 0&&(this.alphaHash=t.alphaHash),t.depthFunc!==void 0&&(this.depthFunc=t.depthFunc),t.depthTest!==void 0&&(this.depthTest=t.depthTest),t.depthWrite!==void 0&&(this.depthWrite=t.depthWrite),t.colorWrite!==void 0&&(this.colorWrite=t.colorWrite),t.clippingPlanes!==void 0&&(this.clippingPlanes=t.clippingPlanes.map(n=>new _i().fromJSON(n))),t.clipIntersection!==void 0&&(this.clipIntersection=t.clipIntersection),t.clipShadows!==void 0&&(this.clipShadows=t.clipShadows),t.depthPacking!==void 0&&(this.depthPacking=t.depthPacking),t.blendSrc!==void 0&&(this.blendSrc=t.blendSrc),t.blendDst!==void 0&&(this.blendDst=t.blendDst),t.blendEquation!==void 0&&(this.blendEquation=t.blendEquation),t.blendSrcAlpha!==void 0&&(this.blendSrcAlpha=t.blendSrcAlpha),t.blendDstAlpha!==void 0&&(this.blendDstAlpha=t.blendDstAlpha),t.blendEquationAlpha!==void 0&&(this.blendEquationAlpha=t.blendEquationAlpha),t.blendColor!==void 0&&this.blendColor!==void 0&&this.blendColor.setHex(t.blendColor),t.blendAlpha!==void 0&&(this.blendAlpha=t.blendAlpha),t.stencilWriteMask!==void 0&&(this.stencilWriteMask=t.stencilWriteMask),t.stencilFunc!==void 0&&(this.stencilFunc=t.stencilFunc),t.stencilRef!==void 0&&(this.stencilRef=t.stencilRef),t.stencilFuncMask!==void 0&&(this.stencilFuncMask=t.stencilFuncMask),t.stencilFail!==void 0&&(this.stencilFail=t.stencilFail),t.stencilZFail!==void 0&&(this.stencilZFail=t.stencilZFail),t.stencilZPass!==void 0&&(this.stencilZPass=t.stencilZPass),t.stencilWrite!==void 0&&(this.stencilWrite=t.stencilWrite),t.wireframe!==void 0&&(this.wireframe=t.wireframe),t.wireframeLinewidth!==void 0&&(this.wireframeLinewidth=t.wireframeLinewidth),t.wireframeLinecap!==void 0&&(this.wireframeLinecap=t.wireframeLinecap),t.wireframeLinejoin!==void 0&&(this.wireframeLinejoin=t.wireframeLinejoin),t.rotation!==void 0&&(this.rotation=t.rotation),t.linewidth!==void 0&&(this.linewidth=t.linewidth),t.linecap!==void 0&&(this.linecap=t.linecap),t.linejoin!==void 0&&(this.linejoin=t.linejoin),t.dashSize!==void 0&&(this.dashSize=t.dashSize),t.gapSize!==void 0&&(this.gapSize=t.gapSize),t.scale!==void 0&&(this.scale=t.scale),t.polygonOffset!==void 0&&(this.polygonOffset=t.polygonOffset),t.polygonOffsetFactor!==void 0&&(this.polygonOffsetFactor=t.polygonOffsetFactor),t.polygonOffsetUnits!==void 0&&(this.polygonOffsetUnits=t.polygonOffsetUnits),t.dithering!==void 0&&(this.dithering=t.dithering),t.alphaToCoverage!==void 0&&(this.alphaToCoverage=t.alphaToCoverage),t.premultipliedAlpha!==void 0&&(this.premultipliedAlpha=t.premultipliedAlpha),t.forceSinglePass!==void 0&&(this.forceSinglePass=t.forceSinglePass),t.allowOverride!==void 0&&(this.allowOverride=t.allowOverride),t.visible!==void 0&&(this.visible=t.visible),t.toneMapped!==void 0&&(this.toneMapped=t.toneMapped),t.userData!==void 0&&(this.userData=t.userData),t.vertexColors!==void 0&&(typeof t.vertexColors=="number"?this.vertexColors=t.vertexColors>0:this.vertexColors=t.vertexColors),t.size!==void 0&&(this.size=t.size),t.sizeAttenuation!==void 0&&(this.sizeAttenuation=t.sizeAttenuation),t.map!==void 0&&(this.map=e[t.map]||null),t.matcap!==void 0&&(this.matcap=e[t.matcap]||null),t.alphaMap!==void 0&&(this.alphaMap=e[t.alphaMap]||null),t.bumpMap!==void 0&&(this.bumpMap=e[t.bumpMap]||null),t.bumpScale!==void 0&&(this.bumpScale=t.bumpScale),t.normalMap!==void 0&&(this.normalMap=e[t.normalMap]||null),t.normalMapType!==void 0&&(this.normalMapType=t.normalMapType),t.normalScale!==void 0){let n=t.normalScale;Array.isArray(n)===!1&&(n=[n,n]),this.normalScale=new Zt().fromArray(n)}return t.displacementMap!==void 0&&(this.displacementMap=e[t.displacementMap]||null),t.displacementScale!==void 0&&(this.displacementScale=t.displacementScale),t.displacementBias!==void 0&&(this.displacementBias=t.displacementBias),t.roughnessMap!==void 0&&(this.roughnessMap=e[t.roughnessMap]||null),t.metalnessMap!==void 0&&(this.metalnessMap=e[t.metalnessMap]||null),t.emissiveMap!==void 0&&(this.emissiveMap=e[t.emissiveMap]||null),t.emissiveIntensity!==void 0&&(this.emissiveIntensity=t.emissiveIntensity),t.specularMap!==void 0&&(this.specularMap=e[t.specularMap]||null),t.specularIntensityMap!==void 0&&(this.specularIntensityMap=e[t.specularIntensityMap]||null),t.specularColorMap!==void 0&&(this.specularColorMap=e[t.specularColorMap]||null),t.envMap!==void 0&&(this.envMap=e[t.envMap]||null),t.envMapRotation!==void 0&&this.envMapRotation.fromArray(t.envMapRotation),t.envMapIntensity!==void 0&&(this.envMapIntensity=t.envMapIntensity),t.reflectivity!==void 0&&(this.reflectivity=t.reflectivity),t.refractionRatio!==void 0&&(this.refractionRatio=t.refractionRatio),t.lightMap!==void 0&&(this.lightMap=e[t.lightMap]||null),t.lightMapIntensity!==void 0&&(this.lightMapIntensity=t.lightMapIntensity),t.aoMap!==void 0&&(this.aoMap=e[t.aoMap]||null),t.aoMapIntensity!==void 0&&(this.aoMapIntensity=t.aoMapIntensity),t.gradientMap!==void 0&&(this.gradientMap=e[t.gradientMap]||null),t.clearcoatMap!==void 0&&(this.clearcoatMap=e[t.clearcoatMap]||null),t.clearcoatRoughnessMap!==void 0&&(this.clearcoatRoughnessMap=e[t.clearcoatRoughnessMap]||null),t.clearcoatNormalMap!==void 0&&(this.clearcoatNormalMap=e[t.clearcoatNormalMap]||null),t.clearcoatNormalScale!==void 0&&(this.clearcoatNormalScale=new Zt().fromArray(t.clearcoatNormalScale)),t.diffuseRoughnessMap!==void 0&&(this.diffuseRoughnessMap=e[t.diffuseRoughnessMap]||null),t.iridescenceMap!==void 0&&(this.iridescenceMap=e[t.iridescenceMap]||null),t.iridescenceThicknessMap!==void 0&&(this.iridescenceThicknessMap=e[t.iridescenceThicknessMap]||null),t.transmissionMap!==void 0&&(this.transmissionMap=e[t.transmissionMap]||null),t.thicknessMap!==void 0&&(this.thicknessMap=e[t.thicknessMap]||null),t.anisotropyMap!==void 0&&(this.anisotropyMap=e[t.anisotropyMap]||null),t.sheenColorMap!==void 0&&(this.sheenColorMap=e[t.sheenColorMap]||null),t.sheenRoughnessMap!==void 0&&(this.sheenRoughnessMap=e[t.sheenRoughnessMap]||null),this}clone(){return new this.constructor().copy(this)}copy(t){this.name=t.name,this.blending=t.blending,this.side=t.side,this.vertexColors=t.vertexColors,this.opacity=t.opacity,this.transparent=t.transparent,this.blendSrc=t.blendSrc,this.blendDst=t.blendDst,this.blendEquation=t.blendEquation,this.blendSrcAlpha=t.blendSrcAlpha,this.blendDstAlpha=t.blendDstAlpha,this.blendEquationAlpha=t.blendEquationAlpha,this.blendColor.copy(t.blendColor),this.blendAlpha=t.blendAlpha,this.depthFunc=t.depthFunc,this.depthTest=t.depthTest,this.depthWrite=t.depthWrite,this.stencilWriteMask=t.stencilWriteMask,this.stencilFunc=t.stencilFunc,this.stencilRef=t.stencilRef,this.stencilFuncMask=t.stencilFuncMask,this.stencilFail=t.stencilFail,this.stencilZFail=t.stencilZFail,this.stencilZPass=t.stencilZPass,this.stencilWrite=t.stencilWrite;let e=t.clippingPlanes,n=null;if(e!==null){let s=e.length;n=new Array(s);for(let r=0;r!==s;++r)n[r]=e[r].clone()}return this.clippingPlanes=n,this.clipIntersection=t.clipIntersection,this.clipShadows=t.clipShadows,this.shadowSide=t.shadowSide,this.colorWrite=t.colorWrite,this.precision=t.precision,this.polygonOffset=t.polygonOffset,this.polygonOffsetFactor=t.polygonOffsetFactor,this.polygonOffsetUnits=t.polygonOffsetUnits,this.dithering=t.dithering,this.alphaTest=t.alphaTest,this.alphaHash=t.alphaHash,this.alphaToCoverage=t.alphaToCoverage,this.premultipliedAlpha=t.premultipliedAlpha,this.forceSinglePass=t.forceSinglePass,this.allowOverride=t.allowOverride,this.visible=t.visible,this.toneMapped=t.toneMapped,this.userData=JSON.parse(JSON.stringify(t.userData)),this}dispose(){this.dispatchEvent({type:"dispose"})}set needsUpdate(t){t===!0&&this.version++}};var As=new k,Yu=new k,kl=new k,zl=new k,Ls=class{constructor(t=new k,e=new k(0,0,-1)){this.origin=t,this.direction=e}set(t,e){return this.origin.copy(t),this.direction.copy(e),this}copy(t){return this.origin.copy(t.origin),this.direction.copy(t.direction),this}at(t,e){return e.copy(this.origin).addScaledVector(this.direction,t)}lookAt(t){return this.direction.copy(t).sub(this.origin).normalize(),this}recast(t){return this.origin.copy(this.at(t,As)),this}closestPointToPoint(t,e){e.subVectors(t,this.origin);let n=e.dot(this.direction);return n<0?e.copy(this.origin):e.copy(this.origin).addScaledVector(this.direction,n)}distanceToPoint(t){return Math.sqrt(this.distanceSqToPoint(t))}distanceSqToPoint(t){let e=As.subVectors(t,this.origin).dot(this.direction);return e<0?this.origin.distanceToSquared(t):(As.copy(this.origin).addScaledVector(this.direction,e),As.distanceToSquared(t))}distanceSqToSegment(t,e,n,s){Yu.copy(t).add(e).multiplyScalar(.5),kl.copy(e).sub(t).normalize(),zl.copy(this.origin).sub(Yu);let r=t.distanceTo(e)*.5,o=-this.direction.dot(kl),a=zl.dot(this.direction),l=-zl.dot(kl),c=zl.lengthSq(),u=Math.abs(1-o*o),h,d,f,m;if(u>0)if(h=o*l-a,d=o*a-l,m=r*u,h>=0)if(d>=-m)if(d<=m){let y=1/u;h*=y,d*=y,f=h*(h+o*d+2*a)+d*(o*h+d+2*l)+c}else d=r,h=Math.max(0,-(o*d+a)),f=-h*h+d*(d+2*l)+c;else d=-r,h=Math.max(0,-(o*d+a)),f=-h*h+d*(d+2*l)+c;else d<=-m?(h=Math.max(0,-(-o*r+a)),d=h>0?-r:Math.min(Math.max(-r,-l),r),f=-h*h+d*(d+2*l)+c):d<=m?(h=0,d=Math.min(Math.max(-r,-l),r),f=d*(d+2*l)+c):(h=Math.max(0,-(o*r+a)),d=h>0?r:Math.min(Math.max(-r,-l),r),f=-h*h+d*(d+2*l)+c);else d=o>0?-r:r,h=Math.max(0,-(o*d+a)),f=-h*h+d*(d+2*l)+c;return n&&n.copy(this.origin).addScaledVector(this.direction,h),s&&s.copy(Yu).addScaledVector(kl,d),f}intersectSphere(t,e){if(t.radius<0)return null;As.subVectors(t.center,this.origin);let n=As.dot(this.direction),s=As.dot(As)-n*n,r=t.radius*t.radius;if(s>r)return null;let o=Math.sqrt(r-s),a=n-o,l=n+o;return l<0?null:a<0?this.at(l,e):this.at(a,e)}intersectsSphere(t){return t.radius<0?!1:this.distanceSqToPoint(t.center)<=t.radius*t.radius}distanceToPlane(t){let e=t.normal.dot(this.direction);if(e===0)return t.distanceToPoint(this.origin)===0?0:null;let n=-(this.origin.dot(t.normal)+t.constant)/e;return n>=0?n:null}intersectPlane(t,e){let n=this.distanceToPlane(t);return n===null?null:this.at(n,e)}intersectsPlane(t){let e=t.distanceToPoint(this.origin);return e===0||t.normal.dot(this.direction)*e<0}intersectBox(t,e){let n,s,r,o,a,l,c=1/this.direction.x,u=1/this.direction.y,h=1/this.direction.z,d=this.origin;return c>=0?(n=(t.min.x-d.x)*c,s=(t.max.x-d.x)*c):(n=(t.max.x-d.x)*c,s=(t.min.x-d.x)*c),u>=0?(r=(t.min.y-d.y)*u,o=(t.max.y-d.y)*u):(r=(t.max.y-d.y)*u,o=(t.min.y-d.y)*u),n>o||r>s||((r>n||isNaN(n))&&(n=r),(o<s||isNaN(s))&&(s=o),h>=0?(a=(t.min.z-d.z)*h,l=(t.max.z-d.z)*h):(a=(t.max.z-d.z)*h,l=(t.min.z-d.z)*h),n>l||a>s)||((a>n||n!==n)&&(n=a),(l<s||s!==s)&&(s=l),s<0)?null:this.at(n>=0?n:s,e)}intersectsBox(t){return this.intersectBox(t,As)!==null}intersectTriangle(t,e,n,s,r){let o=this.origin,a=this.direction,l=a.x,c=a.y,u=a.z,h=t.x-o.x,d=t.y-o.y,f=t.z-o.z,m=e.x-o.x,y=e.y-o.y,p=e.z-o.z,g=n.x-o.x,v=n.y-o.y,E=n.z-o.z,b=Math.abs(l),I=Math.abs(c),A=Math.abs(u),x,T,V,N,L,X,q,D,W,J,H,ht;if(b>=I&&b>=A?(V=l,X=h,W=m,ht=g,l>=0?(x=c,T=u,N=d,L=f,q=y,D=p,J=v,H=E):(x=u,T=c,N=f,L=d,q=p,D=y,J=E,H=v)):I>=A?(V=c,X=d,W=y,ht=v,c>=0?(x=u,T=l,N=f,L=h,q=p,D=m,J=E,H=g):(x=l,T=u,N=h,L=f,q=m,D=p,J=g,H=E)):(V=u,X=f,W=p,ht=E,u>=0?(x=l,T=c,N=h,L=d,q=m,D=y,J=g,H=v):(x=c,T=l,N=d,L=h,q=y,D=m,J=v,H=g)),V===0)return null;let j=x/V,tt=T/V,rt=1/V,ft=N-j*X,dt=L-tt*X,et=q-j*W,gt=D-tt*W,yt=J-j*ht,Ct=H-tt*ht,Mt=yt*gt-Ct*et,Xt=ft*Ct-dt*yt,oe=et*dt-gt*ft;if(s){if(Mt<0||Xt<0||oe<0)return null}else if((Mt<0||Xt<0||oe<0)&&(Mt>0||Xt>0||oe>0))return null;let Ht=Mt+Xt+oe;if(Ht===0)return null;let pe=rt*(Mt*X+Xt*W+oe*ht);return(Ht>0?pe<0:pe>0)?null:this.at(pe/Ht,r)}applyMatrix4(t){return this.origin.applyMatrix4(t),this.direction.transformDirection(t),this}equals(t){return t.origin.equals(this.origin)&&t.direction.equals(this.direction)}clone(){return new this.constructor().copy(this)}},Mr=class extends cs{constructor(t){super(),this.isMeshBasicMaterial=!0,this.type="MeshBasicMaterial",this.color=new he(16777215),this.map=null,this.lightMap=null,this.lightMapIntensity=1,this.aoMap=null,this.aoMapIntensity=1,this.specularMap=null,this.alphaMap=null,this.envMap=null,this.envMapRotation=new Ps,this.combine=Vc,this.reflectivity=1,this.refractionRatio=.98,this.wireframe=!1,this.wireframeLinewidth=1,this.wireframeLinecap="round",this.wireframeLinejoin="round",this.fog=!0,this.setValues(t)}copy(t){return super.copy(t),this.color.copy(t.color),this.map=t.map,this.lightMap=t.lightMap,this.lightMapIntensity=t.lightMapIntensity,this.aoMap=t.aoMap,this.aoMapIntensity=t.aoMapIntensity,this.specularMap=t.specularMap,this.alphaMap=t.alphaMap,this.envMap=t.envMap,this.envMapRotation.copy(t.envMapRotation),this.combine=t.combine,this.reflectivity=t.reflectivity,this.refractionRatio=t.refractionRatio,this.wireframe=t.wireframe,this.wireframeLinewidth=t.wireframeLinewidth,this.wireframeLinecap=t.wireframeLinecap,this.wireframeLinejoin=t.wireframeLinejoin,this.fog=t.fog,this}},zp=new be,Sr=new Ls,Vl=new Ci,Vp=new k,Gl=new k,Hl=new k,Wl=new k,$u=new k,Xl=new k,Gp=new k,ql=new k,Sn=class extends Un{constructor(t=new gn,e=new Mr){super(),this.isMesh=!0,this.type="Mesh",this.geometry=t,this.material=e,this.morphTargetDictionary=void 0,this.morphTargetInfluences=void 0,this.count=1,this.updateMorphTargets()}copy(t,e){return super.copy(t,e),t.morphTargetInfluences!==void 0?this.morphTargetInfluences=t.morphTargetInfluences.slice():this.morphTargetInfluences=void 0,t.morphTargetDictionary!==void 0?this.morphTargetDictionary=Object.assign({},t.morphTargetDictionary):this.morphTargetDictionary=void 0,this.material=Array.isArray(t.material)?t.material.slice():t.material,this.geometry=t.geometry,this}updateMorphTargets(){let e=this.geometry.morphAttributes,n=Object.keys(e);if(n.length>0){let s=e[n[0]];if(s!==void 0){this.morphTargetInfluences=[],this.morphTargetDictionary={};for(let r=0,o=s.length;r<o;r++){let a=s[r].name||String(r);this.morphTargetInfluences.push(0),this.morphTargetDictionary[a]=r}}}}getVertexPosition(t,e){let n=this.geometry,s=n.attributes.position,r=n.morphAttributes.position,o=n.morphTargetsRelative;e.fromBufferAttribute(s,t);let a=this.morphTargetInfluences;if(r&&a){Xl.set(0,0,0);for(let l=0,c=r.length;l<c;l++){let u=a[l],h=r[l];u!==0&&($u.fromBufferAttribute(h,t),o?Xl.addScaledVector($u,u):Xl.addScaledVector($u.sub(e),u))}e.add(Xl)}return e}intersectsFrustum(t){return t.intersectsObject(this)}raycast(t,e){let n=this.geometry,s=this.material,r=this.matrixWorld;s!==void 0&&(n.boundingSphere===null&&n.computeBoundingSphere(),Vl.copy(n.boundingSphere),Vl.applyMatrix4(r),Sr.copy(t.ray).recast(t.near),!(Vl.containsPoint(Sr.origin)===!1&&(Sr.intersectSphere(Vl,Vp)===null||Sr.origin.distanceToSquared(Vp)>(t.far-t.near)**2))&&(zp.copy(r).invert(),Sr.copy(t.ray).applyMatrix4(zp),!(n.boundingBox!==null&&Sr.intersectsBox(n.boundingBox)===!1)&&this._computeIntersections(t,e,Sr)))}_computeIntersections(t,e,n){let s,r=this.geometry,o=this.material,a=r.index,l=r.attributes.position,c=r.attributes.uv,u=r.attributes.uv1,h=r.attributes.normal,d=r.groups,f=r.drawRange;if(a!==null)if(Array.isArray(o))for(let m=0,y=d.length;m<y;m++){let p=d[m],g=o[p.materialIndex],v=Math.max(p.start,f.start),E=Math.min(a.count,Math.min(p.start+p.count,f.start+f.count));for(let b=v,I=E;b<I;b+=3){let A=a.getX(b),x=a.getX(b+1),T=a.getX(b+2);s=Yl(this,g,t,n,c,u,h,A,x,T),s&&(s.faceIndex=Math.floor(b/3),s.face.materialIndex=p.materialIndex,e.push(s))}}else{let m=Math.max(0,f.start),y=Math.min(a.count,f.start+f.count);for(let p=m,g=y;p<g;p+=3){let v=a.getX(p),E=a.getX(p+1),b=a.getX(p+2);s=Yl(this,o,t,n,c,u,h,v,E,b),s&&(s.faceIndex=Math.floor(p/3),e.push(s))}}else if(l!==void 0)if(Array.isArray(o))for(let m=0,y=d.length;m<y;m++){let p=d[m],g=o[p.materialIndex],v=Math.max(p.start,f.start),E=Math.min(l.count,Math.min(p.start+p.count,f.start+f.count));for(let b=v,I=E;b<I;b+=3){let A=b,x=b+1,T=b+2;s=Yl(this,g,t,n,c,u,h,A,x,T),s&&(s.faceIndex=Math.floor(b/3),s.face.materialIndex=p.materialIndex,e.push(s))}}else{let m=Math.max(0,f.start),y=Math.min(l.count,f.start+f.count);for(let p=m,g=y;p<g;p+=3){let v=p,E=p+1,b=p+2;s=Yl(this,o,t,n,c,u,h,v,E,b),s&&(s.faceIndex=Math.floor(p/3),e.push(s))}}}};function Fx(i,t,e,n,s,r,o,a){let l;if(t.side===ni?l=n.intersectTriangle(o,r,s,!0,a):l=n.intersectTriangle(s,r,o,t.side===lr,a),l===null)return null;ql.copy(a),ql.applyMatrix4(i.matrixWorld);let c=e.ray.origin.distanceTo(ql);return c<e.near||c>e.far?null:{distance:c,point:ql.clone(),object:i}}function Yl(i,t,e,n,s,r,o,a,l,c){i.getVertexPosition(a,Gl),i.getVertexPosition(l,Hl),i.getVertexPosition(c,Wl);let u=Fx(i,t,e,n,Gl,Hl,Wl,Gp);if(u){let h=new k;Es.getBarycoord(Gp,Gl,Hl,Wl,h),s&&(u.uv=Es.getInterpolatedAttribute(s,a,l,c,h,new Zt)),r&&(u.uv1=Es.getInterpolatedAttribute(r,a,l,c,h,new Zt)),o&&(u.normal=Es.getInterpolatedAttribute(o,a,l,c,h,new k),u.normal.dot(n.direction)>0&&u.normal.multiplyScalar(-1));let d={a,b:l,c,normal:new k,materialIndex:0};Es.getNormal(Gl,Hl,Wl,d.normal),u.face=d,u.barycoord=h}return u}var bc=class extends ei{constructor(t=null,e=1,n=1,s,r,o,a,l,c=mn,u=mn,h,d){super(null,o,a,l,c,u,s,r,h,d),this.isDataTexture=!0,this.image={data:t,width:e,height:n},this.generateMipmaps=!1,this.flipY=!1,this.unpackAlignment=1}};var br=new Ci,Bx=new Zt(.5,.5),$l=new k,tr=class{constructor(t=new _i,e=new _i,n=new _i,s=new _i,r=new _i,o=new _i){this.planes=[t,e,n,s,r,o]}set(t,e,n,s,r,o){let a=this.planes;return a[0].copy(t),a[1].copy(e),a[2].copy(n),a[3].copy(s),a[4].copy(r),a[5].copy(o),this}copy(t){let e=this.planes;for(let n=0;n<6;n++)e[n].copy(t.planes[n]);return this}setFromProjectionMatrix(t,e=Ei,n=!1){let s=this.planes,r=t.elements,o=r[0],a=r[1],l=r[2],c=r[3],u=r[4],h=r[5],d=r[6],f=r[7],m=r[8],y=r[9],p=r[10],g=r[11],v=r[12],E=r[13],b=r[14],I=r[15];if(s[0].setComponents(c-o,f-u,g-m,I-v).normalize(),s[1].setComponents(c+o,f+u,g+m,I+v).normalize(),s[2].setComponents(c+a,f+h,g+y,I+E).normalize(),s[3].setComponents(c-a,f-h,g-y,I-E).normalize(),n)s[4].setComponents(l,d,p,b).normalize(),s[5].setComponents(c-l,f-d,g-p,I-b).normalize();else if(s[4].setComponents(c-l,f-d,g-p,I-b).normalize(),e===Ei)s[5].setComponents(c+l,f+d,g+p,I+b).normalize();else if(e===Mo)s[5].setComponents(l,d,p,b).normalize();else throw new Error("THREE.Frustum.setFromProjectionMatrix(): Invalid coordinate system: "+e);return this}intersectsObject(t){if(t.boundingSphere!==void 0)t.boundingSphere===null&&t.computeBoundingSphere(),br.copy(t.boundingSphere).applyMatrix4(t.matrixWorld);else{let e=t.geometry;e.boundingSphere===null&&e.computeBoundingSphere(),br.copy(e.boundingSphere).applyMatrix4(t.matrixWorld)}return this.intersectsSphere(br)}intersectsSprite(t){br.center.set(0,0,0);let e=Bx.distanceTo(t.center);return br.radius=.7071067811865476+e,br.applyMatrix4(t.matrixWorld),this.intersectsSphere(br)}intersectsSphere(t){let e=this.planes,n=t.center,s=-t.radius;for(let r=0;r<6;r++)if(e[r].distanceToPoint(n)<s)return!1;return!0}intersectsBox(t){let e=this.planes;for(let n=0;n<6;n++){let s=e[n];if($l.x=s.normal.x>0?t.max.x:t.min.x,$l.y=s.normal.y>0?t.max.y:t.min.y,$l.z=s.normal.z>0?t.max.z:t.min.z,s.distanceToPoint($l)<0)return!1}return!0}containsPoint(t){let e=this.planes;for(let n=0;n<6;n++)if(e[n].distanceToPoint(t)<0)return!1;return!0}clone(){return new this.constructor().copy(this)}},Hp=new be,Mc=class i{constructor(){this.coordinateSystem=Ei,this._frustums=[],this._count=0}setFromArrayCamera(t){let e=t.cameras,n=this._frustums;for(let s=0;s<e.length;s++){let r=e[s];Hp.multiplyMatrices(r.projectionMatrix,r.matrixWorldInverse),n[s]===void 0&&(n[s]=new tr),n[s].setFromProjectionMatrix(Hp,r.coordinateSystem,r.reversedDepth)}return this._count=e.length,this}getFrustum(t){return this._frustums[t]}intersectsObject(t){let e=this._frustums;for(let n=0;n<this._count;n++)if(e[n].intersectsObject(t))return!0;return!1}intersectsSprite(t){let e=this._frustums;for(let n=0;n<this._count;n++)if(e[n].intersectsSprite(t))return!0;return!1}intersectsSphere(t){let e=this._frustums;for(let n=0;n<this._count;n++)if(e[n].intersectsSphere(t))return!0;return!1}intersectsBox(t){let e=this._frustums;for(let n=0;n<this._count;n++)if(e[n].intersectsBox(t))return!0;return!1}containsPoint(t){let e=this._frustums;for(let n=0;n<this._count;n++)if(e[n].containsPoint(t))return!0;return!1}copy(t){this.coordinateSystem=t.coordinateSystem;let e=this._frustums,n=t._frustums;for(let s=0;s<t._count;s++)e[s]===void 0&&(e[s]=new tr),e[s].copy(n[s]);return this._count=t._count,this}clone(){return new i().copy(this)}};var er=class extends cs{constructor(t){super(),this.isLineBasicMaterial=!0,this.type="LineBasicMaterial",this.color=new he(16777215),this.map=null,this.linewidth=1,this.linecap="round",this.linejoin="round",this.fog=!0,this.setValues(t)}copy(t){return super.copy(t),this.color.copy(t.color),this.map=t.map,this.linewidth=t.linewidth,this.linecap=t.linecap,this.linejoin=t.linejoin,this.fog=t.fog,this}},wc=new k,Tc=new k,Wp=new be,xa=new Ls,Kl=new Ci,Ku=new k,Xp=new k,Ro=class extends Un{constructor(t=new gn,e=new er){super(),this.isLine=!0,this.type="Line",this.geometry=t,this.material=e,this.morphTargetDictionary=void 0,this.morphTargetInfluences=void 0,this.updateMorphTargets()}copy(t,e){return super.copy(t,e),t.morphTargetInfluences!==void 0?this.morphTargetInfluences=t.morphTargetInfluences.slice():this.morphTargetInfluences=void 0,t.morphTargetDictionary!==void 0?this.morphTargetDictionary=Object.assign({},t.morphTargetDictionary):this.morphTargetDictionary=void 0,this.material=Array.isArray(t.material)?t.material.slice():t.material,this.geometry=t.geometry,this}computeLineDistances(){let t=this.geometry;if(t.index===null){let e=t.attributes.position,n=[0];for(let s=1,r=e.count;s<r;s++)wc.fromBufferAttribute(e,s-1),Tc.fromBufferAttribute(e,s),n[s]=n[s-1],n[s]+=wc.distanceTo(Tc);t.setAttribute("lineDistance",new sn(n,1))}else $t("Line.computeLineDistances(): Computation only possible with non-indexed BufferGeometry.");return this}intersectsFrustum(t){return t.intersectsObject(this)}raycast(t,e){let n=this.geometry,s=this.matrixWorld,r=t.params.Line.threshold,o=n.drawRange;if(n.boundingSphere===null&&n.computeBoundingSphere(),Kl.copy(n.boundingSphere),Kl.applyMatrix4(s),Kl.radius+=r,t.ray.intersectsSphere(Kl)===!1)return;Wp.copy(s).invert(),xa.copy(t.ray).applyMatrix4(Wp);let a=r/((this.scale.x+this.scale.y+this.scale.z)/3),l=a*a,c=this.isLineSegments?2:1,u=n.index,d=n.attributes.position;if(u!==null){let f=Math.max(0,o.start),m=Math.min(u.count,o.start+o.count);for(let y=f,p=m-1;y<p;y+=c){let g=u.getX(y),v=u.getX(y+1),E=Zl(this,t,xa,l,g,v,y);E&&e.push(E)}if(this.isLineLoop){let y=u.getX(m-1),p=u.getX(f),g=Zl(this,t,xa,l,y,p,m-1);g&&e.push(g)}}else{let f=Math.max(0,o.start),m=Math.min(d.count,o.start+o.count);for(let y=f,p=m-1;y<p;y+=c){let g=Zl(this,t,xa,l,y,y+1,y);g&&e.push(g)}if(this.isLineLoop){let y=Zl(this,t,xa,l,m-1,f,m-1);y&&e.push(y)}}}updateMorphTargets(){let e=this.geometry.morphAttributes,n=Object.keys(e);if(n.length>0){let s=e[n[0]];if(s!==void 0){this.morphTargetInfluences=[],this.morphTargetDictionary={};for(let r=0,o=s.length;r<o;r++){let a=s[r].name||String(r);this.morphTargetInfluences.push(0),this.morphTargetDictionary[a]=r}}}}};function Zl(i,t,e,n,s,r,o){let a=i.geometry.attributes.position;if(wc.fromBufferAttribute(a,s),Tc.fromBufferAttribute(a,r),e.distanceSqToSegment(wc,Tc,Ku,Xp)>n)return;Ku.applyMatrix4(i.matrixWorld);let c=t.ray.origin.distanceTo(Ku);if(!(c<t.near||c>t.far))return{distance:c,point:Xp.clone().applyMatrix4(i.matrixWorld),index:o,face:null,faceIndex:null,barycoord:null,object:i}}var qp=new k,Yp=new k,Io=class extends Ro{constructor(t,e){super(t,e),this.isLineSegments=!0,this.type="LineSegments"}computeLineDistances(){let t=this.geometry;if(t.index===null){let e=t.attributes.position,n=[];for(let s=0,r=e.count;s<r;s+=2)qp.fromBufferAttribute(e,s),Yp.fromBufferAttribute(e,s+1),n[s]=s===0?0:n[s-1],n[s+1]=n[s]+qp.distanceTo(Yp);t.setAttribute("lineDistance",new sn(n,1))}else $t("LineSegments.computeLineDistances(): Computation only possible with non-indexed BufferGeometry.");return this}};var wr=class extends cs{constructor(t){super(),this.isPointsMaterial=!0,this.type="PointsMaterial",this.color=new he(16777215),this.map=null,this.alphaMap=null,this.size=1,this.sizeAttenuation=!0,this.fog=!0,this.setValues(t)}copy(t){return super.copy(t),this.color.copy(t.color),this.map=t.map,this.alphaMap=t.alphaMap,this.size=t.size,this.sizeAttenuation=t.sizeAttenuation,this.fog=t.fog,this}},$p=new be,id=new Ls,Jl=new Ci,jl=new k,Po=class extends Un{constructor(t=new gn,e=new wr){super(),this.isPoints=!0,this.type="Points",this.geometry=t,this.material=e,this.morphTargetDictionary=void 0,this.morphTargetInfluences=void 0,this.updateMorphTargets()}copy(t,e){return super.copy(t,e),t.morphTargetInfluences!==void 0?this.morphTargetInfluences=t.morphTargetInfluences.slice():this.morphTargetInfluences=void 0,t.morphTargetDictionary!==void 0?this.morphTargetDictionary=Object.assign({},t.morphTargetDictionary):this.morphTargetDictionary=void 0,this.material=Array.isArray(t.material)?t.material.slice():t.material,this.geometry=t.geometry,this}intersectsFrustum(t){return t.intersectsObject(this)}raycast(t,e){let n=this.geometry,s=this.matrixWorld,r=t.params.Points.threshold,o=n.drawRange;if(n.boundingSphere===null&&n.computeBoundingSphere(),Jl.copy(n.boundingSphere),Jl.applyMatrix4(s),Jl.radius+=r,t.ray.intersectsSphere(Jl)===!1)return;$p.copy(s).invert(),id.copy(t.ray).applyMatrix4($p);let a=r/((this.scale.x+this.scale.y+this.scale.z)/3),l=a*a,c=n.index,h=n.attributes.position;if(c!==null){let d=Math.max(0,o.start),f=Math.min(c.count,o.start+o.count);for(let m=d,y=f;m<y;m++){let p=c.getX(m);jl.fromBufferAttribute(h,p),Kp(jl,p,l,s,t,e,this)}}else{let d=Math.max(0,o.start),f=Math.min(h.count,o.start+o.count);for(let m=d,y=f;m<y;m++)jl.fromBufferAttribute(h,m),Kp(jl,m,l,s,t,e,this)}}updateMorphTargets(){let e=this.geometry.morphAttributes,n=Object.keys(e);if(n.length>0){let s=e[n[0]];if(s!==void 0){this.morphTargetInfluences=[],this.morphTargetDictionary={};for(let r=0,o=s.length;r<o;r++){let a=s[r].name||String(r);this.morphTargetInfluences.push(0),this.morphTargetDictionary[a]=r}}}}};function Kp(i,t,e,n,s,r,o){let a=id.distanceSqToPoint(i);if(a<e){let l=new k;id.closestPointToPoint(i,l),l.applyMatrix4(n);let c=s.ray.origin.distanceTo(l);if(c<s.near||c>s.far)return;r.push({distance:c,distanceToRay:Math.sqrt(a),point:l,index:t,face:null,faceIndex:null,barycoord:null,object:o})}}var Ia=class extends ei{constructor(t=[],e=Cr,n,s,r,o,a,l,c,u){super(t,e,n,s,r,o,a,l,c,u),this.isCubeTexture=!0,this.flipY=!1}get images(){return this.image}set images(t){this.image=t}},Lo=class extends ei{constructor(t,e,n,s,r,o,a,l,c){super(t,e,n,s,r,o,a,l,c),this.isCanvasTexture=!0,this.needsUpdate=!0}};var Ds=class extends ei{constructor(t,e,n=Gi,s,r,o,a=mn,l=mn,c,u=Is,h=1){if(u!==Is&&u!==Os)throw new Error("THREE.DepthTexture: format must be either THREE.DepthFormat or THREE.DepthStencilFormat");let d={width:t,height:e,depth:h};super(d,s,r,o,a,l,u,n,c),this.isDepthTexture=!0,this.flipY=!1,this.generateMipmaps=!1,this.compareFunction=null}copy(t){return super.copy(t),this.source=new Ao(Object.assign({},t.image)),this.compareFunction=t.compareFunction,this}toJSON(t){let e=super.toJSON(t);return e.compareFunction=this.compareFunction,e}},Pa=class extends Ds{constructor(t,e=Gi,n=Cr,s,r,o=mn,a=mn,l,c=Is){let u={width:t,height:t,depth:1},h=[u,u,u,u,u,u];super(t,t,e,n,s,r,o,a,l,c),this.image=h,this.isCubeDepthTexture=!0,this.isCubeTexture=!0}get images(){return this.image}set images(t){this.image=t}},La=class extends ei{constructor(t=null){super(),this.sourceTexture=t,this.isExternalTexture=!0}copy(t){return super.copy(t),this.sourceTexture=t.sourceTexture,this}},hs=class i extends gn{constructor(t=1,e=1,n=1,s=1,r=1,o=1){super(),this.type="BoxGeometry",this.parameters={width:t,height:e,depth:n,widthSegments:s,heightSegments:r,depthSegments:o};let a=this;s=Math.floor(s),r=Math.floor(r),o=Math.floor(o);let l=[],c=[],u=[],h=[],d=0,f=0;m("z","y","x",-1,-1,n,e,t,o,r,0),m("z","y","x",1,-1,n,e,-t,o,r,1),m("x","z","y",1,1,t,n,e,s,o,2),m("x","z","y",1,-1,t,n,-e,s,o,3),m("x","y","z",1,-1,t,e,n,s,r,4),m("x","y","z",-1,-1,t,e,-n,s,r,5),this.setIndex(l),this.setAttribute("position",new sn(c,3)),this.setAttribute("normal",new sn(u,3)),this.setAttribute("uv",new sn(h,2));function m(y,p,g,v,E,b,I,A,x,T,V){let N=b/x,L=I/T,X=b/2,q=I/2,D=A/2,W=x+1,J=T+1,H=0,ht=0,j=new k;for(let tt=0;tt<J;tt++){let rt=tt*L-q;for(let ft=0;ft<W;ft++){let dt=ft*N-X;j[y]=dt*v,j[p]=rt*E,j[g]=D,c.push(j.x,j.y,j.z),j[y]=0,j[p]=0,j[g]=A>0?1:-1,u.push(j.x,j.y,j.z),h.push(ft/x),h.push(1-tt/T),H+=1}}for(let tt=0;tt<T;tt++)for(let rt=0;rt<x;rt++){let ft=d+rt+W*tt,dt=d+rt+W*(tt+1),et=d+(rt+1)+W*(tt+1),gt=d+(rt+1)+W*tt;l.push(ft,dt,gt),l.push(dt,et,gt),ht+=6}a.addGroup(f,ht,V),f+=ht,d+=H}}copy(t){return super.copy(t),this.parameters=Object.assign({},t.parameters),this}static fromJSON(t){return new i(t.width,t.height,t.depth,t.widthSegments,t.heightSegments,t.depthSegments)}};var Ql=new k,tc=new k,Zu=new k,ec=new Es,Do=class extends gn{constructor(t=null,e=1){if(super(),this.type="EdgesGeometry",this.parameters={geometry:t,thresholdAngle:e},t!==null){let s=Math.pow(10,4),r=Math.cos(vo*e),o=t.getIndex(),a=t.getAttribute("position"),l=o?o.count:a.count,c=[0,0,0],u=["a","b","c"],h=new Array(3),d=new Map,f=[];for(let m=0;m<l;m+=3){o?(c[0]=o.getX(m),c[1]=o.getX(m+1),c[2]=o.getX(m+2)):(c[0]=m,c[1]=m+1,c[2]=m+2);let{a:y,b:p,c:g}=ec;if(y.fromBufferAttribute(a,c[0]),p.fromBufferAttribute(a,c[1]),g.fromBufferAttribute(a,c[2]),ec.getNormal(Zu),h[0]=`${Math.round(y.x*s)},${Math.round(y.y*s)},${Math.round(y.z*s)}`,h[1]=`${Math.round(p.x*s)},${Math.round(p.y*s)},${Math.round(p.z*s)}`,h[2]=`${Math.round(g.x*s)},${Math.round(g.y*s)},${Math.round(g.z*s)}`,!(h[0]===h[1]||h[1]===h[2]||h[2]===h[0]))for(let v=0;v<3;v++){let E=(v+1)%3,b=h[v],I=h[E],A=ec[u[v]],x=ec[u[E]],T=`${b}_${I}`,V=`${I}_${b}`,N=d.get(V);N?(Zu.dot(N.normal)<=r&&(f.push(A.x,A.y,A.z),f.push(x.x,x.y,x.z)),d.set(V,null)):d.has(T)||d.set(T,{index0:c[v],index1:c[E],normal:Zu.clone()})}}for(let m of d.values())if(m){let{index0:y,index1:p}=m;Ql.fromBufferAttribute(a,y),tc.fromBufferAttribute(a,p),f.push(Ql.x,Ql.y,Ql.z),f.push(tc.x,tc.y,tc.z)}this.setAttribute("position",new sn(f,3))}}copy(t){return super.copy(t),this.parameters=Object.assign({},t.parameters),this}};var Tr=class i extends gn{constructor(t=1,e=1,n=1,s=1){super(),this.type="PlaneGeometry",this.parameters={width:t,height:e,widthSegments:n,heightSegments:s};let r=t/2,o=e/2,a=Math.floor(n),l=Math.floor(s),c=a+1,u=l+1,h=t/a,d=e/l,f=[],m=[],y=[],p=[];for(let g=0;g<u;g++){let v=g*d-o;for(let E=0;E<c;E++){let b=E*h-r;m.push(b,-v,0),y.push(0,0,1),p.push(E/a),p.push(1-g/l)}}for(let g=0;g<l;g++)for(let v=0;v<a;v++){let E=v+c*g,b=v+c*(g+1),I=v+1+c*(g+1),A=v+1+c*g;f.push(E,b,A),f.push(b,I,A)}this.setIndex(f),this.setAttribute("position",new sn(m,3)),this.setAttribute("normal",new sn(y,3)),this.setAttribute("uv",new sn(p,2))}copy(t){return super.copy(t),this.parameters=Object.assign({},t.parameters),this}static fromJSON(t){return new i(t.width,t.height,t.widthSegments,t.heightSegments)}};var No=class i extends gn{constructor(t=1,e=32,n=16,s=0,r=Math.PI*2,o=0,a=Math.PI){super(),this.type="SphereGeometry",this.parameters={radius:t,widthSegments:e,heightSegments:n,phiStart:s,phiLength:r,thetaStart:o,thetaLength:a},e=Math.max(3,Math.floor(e)),n=Math.max(2,Math.floor(n));let l=Math.min(o+a,Math.PI),c=0,u=[],h=new k,d=new k,f=[],m=[],y=[],p=[];for(let g=0;g<=n;g++){let v=[],E=g/n,b=o+E*a,I=t*Math.cos(b),A=Math.sqrt(t*t-I*I),x=0;g===0&&o===0?x=.5/e:g===n&&l===Math.PI&&(x=-.5/e);for(let T=0;T<=e;T++){let V=T/e,N=s+V*r;h.x=-A*Math.cos(N),h.y=I,h.z=A*Math.sin(N),m.push(h.x,h.y,h.z),d.copy(h).normalize(),y.push(d.x,d.y,d.z),p.push(V+x,1-E),v.push(c++)}u.push(v)}for(let g=0;g<n;g++)for(let v=0;v<e;v++){let E=u[g][v+1],b=u[g][v],I=u[g+1][v],A=u[g+1][v+1];(g!==0||o>0)&&f.push(E,b,A),(g!==n-1||l<Math.PI)&&f.push(b,I,A)}this.setIndex(f),this.setAttribute("position",new sn(m,3)),this.setAttribute("normal",new sn(y,3)),this.setAttribute("uv",new sn(p,2))}copy(t){return super.copy(t),this.parameters=Object.assign({},t.parameters),this}static fromJSON(t){return new i(t.radius,t.widthSegments,t.heightSegments,t.phiStart,t.phiLength,t.thetaStart,t.thetaLength)}};var Da=class extends gn{constructor(t=null){if(super(),this.type="WireframeGeometry",this.parameters={geometry:t},t!==null){let e=[],n=new Set,s=new k,r=new k;if(t.index!==null){let o=t.attributes.position,a=t.index,l=t.groups;l.length===0&&(l=[{start:0,count:a.count,materialIndex:0}]);for(let c=0,u=l.length;c<u;++c){let h=l[c],d=h.start,f=h.count;for(let m=d,y=d+f;m<y;m+=3)for(let p=0;p<3;p++){let g=a.getX(m+p),v=a.getX(m+(p+1)%3);s.fromBufferAttribute(o,g),r.fromBufferAttribute(o,v),Zp(s,r,n)===!0&&(e.push(s.x,s.y,s.z),e.push(r.x,r.y,r.z))}}}else{let o=t.attributes.position;for(let a=0,l=o.count/3;a<l;a++)for(let c=0;c<3;c++){let u=3*a+c,h=3*a+(c+1)%3;s.fromBufferAttribute(o,u),r.fromBufferAttribute(o,h),Zp(s,r,n)===!0&&(e.push(s.x,s.y,s.z),e.push(r.x,r.y,r.z))}}this.setAttribute("position",new sn(e,3))}}copy(t){return super.copy(t),this.parameters=Object.assign({},t.parameters),this}};function Zp(i,t,e){let n=`${i.x},${i.y},${i.z}-${t.x},${t.y},${t.z}`,s=`${t.x},${t.y},${t.z}-${i.x},${i.y},${i.z}`;return e.has(n)===!0||e.has(s)===!0?!1:(e.add(n),e.add(s),!0)}function Ir(i){let t={};for(let e in i){t[e]={};for(let n in i[e]){let s=i[e][n];if(Jp(s))s.isRenderTargetTexture?($t("UniformsUtils: Textures of render targets cannot be cloned via cloneUniforms() or mergeUniforms()."),t[e][n]=null):t[e][n]=s.clone();else if(Array.isArray(s))if(Jp(s[0])){let r=[];for(let o=0,a=s.length;o<a;o++)r[o]=s[o].clone();t[e][n]=r}else t[e][n]=s.slice();else t[e][n]=s}}return t}function Wn(i){let t={};for(let e=0;e<i.length;e++){let n=Ir(i[e]);for(let s in n)t[s]=n[s]}return t}function Jp(i){return i&&(i.isColor||i.isMatrix3||i.isMatrix4||i.isVector2||i.isVector3||i.isVector4||i.isTexture||i.isQuaternion)}function kx(i){let t=[];for(let e=0;e<i.length;e++)t.push(i[e].clone());return t}function Bd(i){let t=i.getRenderTarget();return t===null?i.outputColorSpace:t.isXRRenderTarget===!0?t.texture.colorSpace:ye.workingColorSpace}var Qa={clone:Ir,merge:Wn},zx=`void main() {
	gl_Position = projectionMatrix * modelViewMatrix * vec4( position, 1.0 );
}`,Vx=`void main() {
	gl_FragColor = vec4( 1.0, 0.0, 0.0, 1.0 );
}`,Ri=class extends cs{constructor(t){super(),this.isShaderMaterial=!0,this.type="ShaderMaterial",this.defines={},this.uniforms={},this.uniformsGroups=[],this.vertexShader=zx,this.fragmentShader=Vx,this.linewidth=1,this.wireframe=!1,this.wireframeLinewidth=1,this.fog=!1,this.lights=!1,this.clipping=!1,this.forceSinglePass=!0,this.extensions={clipCullDistance:!1,multiDraw:!1},this.defaultAttributeValues={color:[1,1,1],uv:[0,0],uv1:[0,0]},this.index0AttributeName=void 0,this.uniformsNeedUpdate=!1,this.glslVersion=null,t!==void 0&&this.setValues(t)}copy(t){return super.copy(t),this.fragmentShader=t.fragmentShader,this.vertexShader=t.vertexShader,this.uniforms=Ir(t.uniforms),this.uniformsGroups=kx(t.uniformsGroups),this.defines=Object.assign({},t.defines),this.wireframe=t.wireframe,this.wireframeLinewidth=t.wireframeLinewidth,this.fog=t.fog,this.lights=t.lights,this.clipping=t.clipping,this.extensions=Object.assign({},t.extensions),this.glslVersion=t.glslVersion,this.defaultAttributeValues=Object.assign({},t.defaultAttributeValues),this.index0AttributeName=t.index0AttributeName,this.uniformsNeedUpdate=t.uniformsNeedUpdate,this}toJSON(t){let e=super.toJSON(t);e.glslVersion=this.glslVersion,e.uniforms={};for(let s in this.uniforms){let o=this.uniforms[s].value;o&&o.isTexture?e.uniforms[s]={type:"t",value:o.toJSON(t).uuid}:o&&o.isColor?e.uniforms[s]={type:"c",value:o.getHex()}:o&&o.isVector2?e.uniforms[s]={type:"v2",value:o.toArray()}:o&&o.isVector3?e.uniforms[s]={type:"v3",value:o.toArray()}:o&&o.isVector4?e.uniforms[s]={type:"v4",value:o.toArray()}:o&&o.isMatrix3?e.uniforms[s]={type:"m3",value:o.toArray()}:o&&o.isMatrix4?e.uniforms[s]={type:"m4",value:o.toArray()}:e.uniforms[s]={value:o}}Object.keys(this.defines).length>0&&(e.defines=this.defines),e.vertexShader=this.vertexShader,e.fragmentShader=this.fragmentShader,e.lights=this.lights,e.clipping=this.clipping;let n={};for(let s in this.extensions)this.extensions[s]===!0&&(n[s]=!0);return Object.keys(n).length>0&&(e.extensions=n),e}fromJSON(t,e){if(super.fromJSON(t,e),t.uniforms!==void 0)for(let n in t.uniforms){let s=t.uniforms[n];switch(this.uniforms[n]={},s.type){case"t":this.uniforms[n].value=e[s.value]||null;break;case"c":this.uniforms[n].value=new he().setHex(s.value);break;case"v2":this.uniforms[n].value=new Zt().fromArray(s.value);break;case"v3":this.uniforms[n].value=new k().fromArray(s.value);break;case"v4":this.uniforms[n].value=new Ie().fromArray(s.value);break;case"m3":this.uniforms[n].value=new ie().fromArray(s.value);break;case"m4":this.uniforms[n].value=new be().fromArray(s.value);break;default:this.uniforms[n].value=s.value}}if(t.defines!==void 0&&(this.defines=t.defines),t.vertexShader!==void 0&&(this.vertexShader=t.vertexShader),t.fragmentShader!==void 0&&(this.fragmentShader=t.fragmentShader),t.glslVersion!==void 0&&(this.glslVersion=t.glslVersion),t.extensions!==void 0)for(let n in t.extensions)this.extensions[n]=t.extensions[n];return t.lights!==void 0&&(this.lights=t.lights),t.clipping!==void 0&&(this.clipping=t.clipping),this}},Ac=class extends Ri{constructor(t){super(t),this.isRawShaderMaterial=!0,this.type="RawShaderMaterial"}};var Ns=class extends cs{constructor(t){super(),this.isMeshLambertMaterial=!0,this.type="MeshLambertMaterial",this.color=new he(16777215),this.map=null,this.lightMap=null,this.lightMapIntensity=1,this.aoMap=null,this.aoMapIntensity=1,this.emissive=new he(0),this.emissiveIntensity=1,this.emissiveMap=null,this.bumpMap=null,this.bumpScale=1,this.normalMap=null,this.normalMapType=Eh,this.normalScale=new Zt(1,1),this.displacementMap=null,this.displacementScale=1,this.displacementBias=0,this.specularMap=null,this.alphaMap=null,this.envMap=null,this.envMapRotation=new Ps,this.combine=Vc,this.reflectivity=1,this.envMapIntensity=1,this.refractionRatio=.98,this.wireframe=!1,this.wireframeLinewidth=1,this.wireframeLinecap="round",this.wireframeLinejoin="round",this.flatShading=!1,this.fog=!0,this.setValues(t)}copy(t){return super.copy(t),this.color.copy(t.color),this.map=t.map,this.lightMap=t.lightMap,this.lightMapIntensity=t.lightMapIntensity,this.aoMap=t.aoMap,this.aoMapIntensity=t.aoMapIntensity,this.emissive.copy(t.emissive),this.emissiveMap=t.emissiveMap,this.emissiveIntensity=t.emissiveIntensity,this.bumpMap=t.bumpMap,this.bumpScale=t.bumpScale,this.normalMap=t.normalMap,this.normalMapType=t.normalMapType,this.normalScale.copy(t.normalScale),this.displacementMap=t.displacementMap,this.displacementScale=t.displacementScale,this.displacementBias=t.displacementBias,this.specularMap=t.specularMap,this.alphaMap=t.alphaMap,this.envMap=t.envMap,this.envMapRotation.copy(t.envMapRotation),this.combine=t.combine,this.reflectivity=t.reflectivity,this.envMapIntensity=t.envMapIntensity,this.refractionRatio=t.refractionRatio,this.wireframe=t.wireframe,this.wireframeLinewidth=t.wireframeLinewidth,this.wireframeLinecap=t.wireframeLinecap,this.wireframeLinejoin=t.wireframeLinejoin,this.flatShading=t.flatShading,this.fog=t.fog,this}},Ec=class extends cs{constructor(t){super(),this.isMeshDepthMaterial=!0,this.type="MeshDepthMaterial",this.depthPacking=Pm,this.map=null,this.alphaMap=null,this.displacementMap=null,this.displacementScale=1,this.displacementBias=0,this.wireframe=!1,this.wireframeLinewidth=1,this.setValues(t)}copy(t){return super.copy(t),this.depthPacking=t.depthPacking,this.map=t.map,this.alphaMap=t.alphaMap,this.displacementMap=t.displacementMap,this.displacementScale=t.displacementScale,this.displacementBias=t.displacementBias,this.wireframe=t.wireframe,this.wireframeLinewidth=t.wireframeLinewidth,this}},Cc=class extends cs{constructor(t){super(),this.isMeshDistanceMaterial=!0,this.type="MeshDistanceMaterial",this.map=null,this.alphaMap=null,this.displacementMap=null,this.displacementScale=1,this.displacementBias=0,this.setValues(t)}copy(t){return super.copy(t),this.map=t.map,this.alphaMap=t.alphaMap,this.displacementMap=t.displacementMap,this.displacementScale=t.displacementScale,this.displacementBias=t.displacementBias,this}};function mo(i,t){return!i||i.constructor===t?i:typeof t.BYTES_PER_ELEMENT=="number"?new t(i):Array.prototype.slice.call(i)}function nc(i){return i!==void 0&&i.inTangents!==void 0&&i.outTangents!==void 0}var nr=class{constructor(t,e,n,s){this.parameterPositions=t,this._cachedIndex=0,this.resultBuffer=s!==void 0?s:new e.constructor(n),this.sampleValues=e,this.valueSize=n,this.settings=null,this.DefaultSettings_={}}evaluate(t){let e=this.parameterPositions,n=this._cachedIndex,s=e[n],r=e[n-1];n:{t:{let o;e:{i:if(!(t<s)){for(let a=n+2;;){if(s===void 0){if(t<r)break i;return n=e.length,this._cachedIndex=n,this.copySampleValue_(n-1)}if(n===a)break;if(r=s,s=e[++n],t<s)break t}o=e.length;break e}if(!(t>=r)){let a=e[1];t<a&&(n=2,r=a);for(let l=n-2;;){if(r===void 0)return this._cachedIndex=0,this.copySampleValue_(0);if(n===l)break;if(s=r,r=e[--n-1],t>=r)break t}o=n,n=0;break e}break n}for(;n<o;){let a=n+o>>>1;t<e[a]?o=a:n=a+1}if(s=e[n],r=e[n-1],r===void 0)return this._cachedIndex=0,this.copySampleValue_(0);if(s===void 0)return n=e.length,this._cachedIndex=n,this.copySampleValue_(n-1)}this._cachedIndex=n,this.intervalChanged_(n,r,s)}return this.interpolate_(n,r,t,s)}getSettings_(){return this.settings||this.DefaultSettings_}copySampleValue_(t){let e=this.resultBuffer,n=this.sampleValues,s=this.valueSize,r=t*s;for(let o=0;o!==s;++o)e[o]=n[r+o];return e}interpolate_(){throw new Error("THREE.Interpolant: Call to abstract method.")}intervalChanged_(){}},Rc=class extends nr{constructor(t,e,n,s){super(t,e,n,s),this._weightPrev=-0,this._offsetPrev=-0,this._weightNext=-0,this._offsetNext=-0,this.DefaultSettings_={endingStart:td,endingEnd:td}}intervalChanged_(t,e,n){let s=this.parameterPositions,r=t-2,o=t+1,a=s[r],l=s[o];if(a===void 0)switch(this.getSettings_().endingStart){case ed:r=t,a=2*e-n;break;case nd:r=s.length-2,a=e+s[r]-s[r+1];break;default:r=t,a=n}if(l===void 0)switch(this.getSettings_().endingEnd){case ed:o=t,l=2*n-e;break;case nd:o=1,l=n+s[1]-s[0];break;default:o=t-1,l=e}let c=(n-e)*.5,u=this.valueSize;this._weightPrev=c/(e-a),this._weightNext=c/(l-n),this._offsetPrev=r*u,this._offsetNext=o*u}interpolate_(t,e,n,s){let r=this.resultBuffer,o=this.sampleValues,a=this.valueSize,l=t*a,c=l-a,u=this._offsetPrev,h=this._offsetNext,d=this._weightPrev,f=this._weightNext,m=(n-e)/(s-e),y=m*m,p=y*m,g=-d*p+2*d*y-d*m,v=(1+d)*p+(-1.5-2*d)*y+(-.5+d)*m+1,E=(-1-f)*p+(1.5+f)*y+.5*m,b=f*p-f*y;for(let I=0;I!==a;++I)r[I]=g*o[u+I]+v*o[c+I]+E*o[l+I]+b*o[h+I];return r}},Ic=class extends nr{constructor(t,e,n,s){super(t,e,n,s)}interpolate_(t,e,n,s){let r=this.resultBuffer,o=this.sampleValues,a=this.valueSize,l=t*a,c=l-a,u=(n-e)/(s-e),h=1-u;for(let d=0;d!==a;++d)r[d]=o[c+d]*h+o[l+d]*u;return r}},Pc=class extends nr{constructor(t,e,n,s){super(t,e,n,s)}interpolate_(t){return this.copySampleValue_(t-1)}},Lc=class extends nr{interpolate_(t,e,n,s){let r=this.resultBuffer,o=this.sampleValues,a=this.valueSize,l=t*a,c=l-a,u=this.inTangents,h=this.outTangents;if(!u||!h){let m=(n-e)/(s-e),y=1-m;for(let p=0;p!==a;++p)r[p]=o[c+p]*y+o[l+p]*m;return r}let d=a*2,f=t-1;for(let m=0;m!==a;++m){let y=o[c+m],p=o[l+m],g=f*d+m*2,v=h[g],E=h[g+1],b=t*d+m*2,I=u[b],A=u[b+1],x=Hx(n,e,v,I,s);r[m]=Wm(x,y,E,A,p)}return r}};function Wm(i,t,e,n,s){let r=1-i;return r*r*r*t+3*r*r*i*e+3*r*i*i*n+i*i*i*s}function Gx(i,t,e,n,s){let r=1-i;return 3*r*r*(e-t)+6*r*i*(n-e)+3*i*i*(s-n)}function Hx(i,t,e,n,s){let r=(i-t)/(s-t);for(let o=0;o<8;o++){let a=Wm(r,t,e,n,s)-i;if(Math.abs(a)<1e-10)break;let l=Gx(r,t,e,n,s);if(Math.abs(l)<1e-10)break;r=Math.max(0,Math.min(1,r-a/l))}return r}var vi=class{constructor(t,e,n,s){if(t===void 0)throw new Error("THREE.KeyframeTrack: track name is undefined");if(e===void 0||e.length===0)throw new Error("THREE.KeyframeTrack: no keyframes in track named "+t);this.name=t,this.times=mo(e,this.TimeBufferType),this.values=mo(n,this.ValueBufferType),this.setInterpolation(s||this.DefaultInterpolation)}static toJSON(t){let e=t.constructor,n;if(e.toJSON!==this.toJSON)n=e.toJSON(t);else{n={name:t.name,times:mo(t.times,Array),values:mo(t.values,Array)};let s=t.getInterpolation();s!==t.DefaultInterpolation&&(n.interpolation=s),nc(t.settings)&&(n.settings={inTangents:mo(t.settings.inTangents,Array),outTangents:mo(t.settings.outTangents,Array)})}return n.type=t.ValueTypeName,n}InterpolantFactoryMethodDiscrete(t){return new Pc(this.times,this.values,this.getValueSize(),t)}InterpolantFactoryMethodLinear(t){return new Ic(this.times,this.values,this.getValueSize(),t)}InterpolantFactoryMethodSmooth(t){return new Rc(this.times,this.values,this.getValueSize(),t)}InterpolantFactoryMethodBezier(t){let e=new Lc(this.times,this.values,this.getValueSize(),t);return this.settings&&(e.inTangents=this.settings.inTangents,e.outTangents=this.settings.outTangents),e}setInterpolation(t){let e;switch(t){case Sa:e=this.InterpolantFactoryMethodDiscrete;break;case _c:e=this.InterpolantFactoryMethodLinear;break;case oc:e=this.InterpolantFactoryMethodSmooth;break;case Qu:e=this.InterpolantFactoryMethodBezier;break}if(e===void 0){let n="unsupported interpolation for "+this.ValueTypeName+" keyframe track named "+this.name;if(this.createInterpolant===void 0)if(t!==this.DefaultInterpolation)this.setInterpolation(this.DefaultInterpolation);else throw new Error(n);return $t("KeyframeTrack:",n),this}return this.createInterpolant=e,this}getInterpolation(){switch(this.createInterpolant){case this.InterpolantFactoryMethodDiscrete:return Sa;case this.InterpolantFactoryMethodLinear:return _c;case this.InterpolantFactoryMethodSmooth:return oc;case this.InterpolantFactoryMethodBezier:return Qu}}getValueSize(){return this.values.length/this.times.length}shift(t){if(t!==0){let e=this.times;for(let n=0,s=e.length;n!==s;++n)e[n]+=t;nc(this.settings)&&(jp(this.settings.inTangents,t),jp(this.settings.outTangents,t))}return this}scale(t){if(t!==1){let e=this.times;for(let n=0,s=e.length;n!==s;++n)e[n]*=t;nc(this.settings)&&(Qp(this.settings.inTangents,t),Qp(this.settings.outTangents,t))}return this}trim(t,e){let n=this.times,s=n.length,r=0,o=s-1;for(;r!==s&&n[r]<t;)++r;for(;o!==-1&&n[o]>e;)--o;if(++o,r!==0||o!==s){r>=o&&(o=Math.max(o,1),r=o-1);let a=this.getValueSize();this.times=n.slice(r,o),this.values=this.values.slice(r*a,o*a)}return this}validate(){let t=!0,e=this.getValueSize();e-Math.floor(e)!==0&&(ee("KeyframeTrack: Invalid value size in track.",this),t=!1);let n=this.times,s=this.values,r=n.length;r===0&&(ee("KeyframeTrack: Track is empty.",this),t=!1);let o=null;for(let a=0;a!==r;a++){let l=n[a];if(typeof l=="number"&&isNaN(l)){ee("KeyframeTrack: Time is not a valid number.",this,a,l),t=!1;break}if(o!==null&&o>l){ee("KeyframeTrack: Out of order keys.",this,a,l,o),t=!1;break}o=l}if(s!==void 0&&rx(s))for(let a=0,l=s.length;a!==l;++a){let c=s[a];if(isNaN(c)){ee("KeyframeTrack: Value is not a valid number.",this,a,c),t=!1;break}}return t}optimize(){let t=this.times.slice(),e=this.values.slice(),n=this.getValueSize(),s=this.getInterpolation()===oc,r=t.length-1,o=1;for(let a=1;a<r;++a){let l=!1,c=t[a],u=t[a+1];if(c!==u&&(a!==1||c!==t[0]))if(s)l=!0;else{let h=a*n,d=h-n,f=h+n;for(let m=0;m!==n;++m){let y=e[h+m];if(y!==e[d+m]||y!==e[f+m]){l=!0;break}}}if(l){if(a!==o){t[o]=t[a];let h=a*n,d=o*n;for(let f=0;f!==n;++f)e[d+f]=e[h+f]}++o}}if(r>0){t[o]=t[r];for(let a=r*n,l=o*n,c=0;c!==n;++c)e[l+c]=e[a+c];++o}return o!==t.length?(this.times=t.slice(0,o),this.values=e.slice(0,o*n)):(this.times=t,this.values=e),this}clone(){let t=this.times.slice(),e=this.values.slice(),n=this.constructor,s=new n(this.name,t,e);return s.createInterpolant=this.createInterpolant,nc(this.settings)&&(s.settings={inTangents:this.settings.inTangents.slice(),outTangents:this.settings.outTangents.slice()}),s}};function jp(i,t){for(let e=0,n=i.length;e!==n;e+=2)i[e]+=t}function Qp(i,t){for(let e=0,n=i.length;e!==n;e+=2)i[e]*=t}vi.prototype.ValueTypeName="";vi.prototype.TimeBufferType=Float32Array;vi.prototype.ValueBufferType=Float32Array;vi.prototype.DefaultInterpolation=_c;var ir=class extends vi{constructor(t,e,n){super(t,e,n)}};ir.prototype.ValueTypeName="bool";ir.prototype.ValueBufferType=Array;ir.prototype.DefaultInterpolation=Sa;ir.prototype.InterpolantFactoryMethodLinear=void 0;ir.prototype.InterpolantFactoryMethodSmooth=void 0;var Dc=class extends vi{constructor(t,e,n,s){super(t,e,n,s)}};Dc.prototype.ValueTypeName="color";var Nc=class extends vi{constructor(t,e,n,s){super(t,e,n,s)}};Nc.prototype.ValueTypeName="number";var Uc=class extends nr{constructor(t,e,n,s){super(t,e,n,s)}interpolate_(t,e,n,s){let r=this.resultBuffer,o=this.sampleValues,a=this.valueSize,l=(n-e)/(s-e),c=t*a;for(let u=c+a;c!==u;c+=4)Je.slerpFlat(r,0,o,c-a,o,c,l);return r}},Na=class extends vi{constructor(t,e,n,s){super(t,e,n,s)}InterpolantFactoryMethodLinear(t){return new Uc(this.times,this.values,this.getValueSize(),t)}};Na.prototype.ValueTypeName="quaternion";Na.prototype.InterpolantFactoryMethodSmooth=void 0;var sr=class extends vi{constructor(t,e,n){super(t,e,n)}};sr.prototype.ValueTypeName="string";sr.prototype.ValueBufferType=Array;sr.prototype.DefaultInterpolation=Sa;sr.prototype.InterpolantFactoryMethodLinear=void 0;sr.prototype.InterpolantFactoryMethodSmooth=void 0;var Oc=class extends vi{constructor(t,e,n,s){super(t,e,n,s)}};Oc.prototype.ValueTypeName="vector";var Fc=class{constructor(t,e,n){let s=this,r=!1,o=0,a=0,l,c=[];this.onStart=void 0,this.onLoad=t,this.onProgress=e,this.onError=n,this._abortController=null,this.itemStart=function(u){a++,r===!1&&s.onStart!==void 0&&s.onStart(u,o,a),r=!0},this.itemEnd=function(u){o++,s.onProgress!==void 0&&s.onProgress(u,o,a),o===a&&(r=!1,s.onLoad!==void 0&&s.onLoad())},this.itemError=function(u){s.onError!==void 0&&s.onError(u)},this.resolveURL=function(u){return u=u.normalize("NFC"),l?l(u):u},this.setURLModifier=function(u){return l=u,this},this.addHandler=function(u,h){return c.push(u,h),this},this.removeHandler=function(u){let h=c.indexOf(u);return h!==-1&&c.splice(h,2),this},this.getHandler=function(u){for(let h=0,d=c.length;h<d;h+=2){let f=c[h],m=c[h+1];if(f.global&&(f.lastIndex=0),f.test(u))return m}return null},this.abort=function(){return this.abortController.abort(),this._abortController=null,this}}get abortController(){return this._abortController||(this._abortController=new AbortController),this._abortController}},Xm=new Fc,Bc=class{constructor(t){this.manager=t!==void 0?t:Xm,this.crossOrigin="anonymous",this.withCredentials=!1,this.path="",this.resourcePath="",this.requestHeader={},this.priority="auto",this.cache="default",typeof __THREE_DEVTOOLS__<"u"&&__THREE_DEVTOOLS__.dispatchEvent(new CustomEvent("observe",{detail:this}))}load(){}loadAsync(t,e){let n=this;return new Promise(function(s,r){n.load(t,s,e,r)})}parse(){}setCrossOrigin(t){return this.crossOrigin=t,this}setWithCredentials(t){return this.withCredentials=t,this}setPath(t){return this.path=t,this}setResourcePath(t){return this.resourcePath=t,this}setRequestHeader(t){return this.requestHeader=t,this}setPriority(t){return this.priority=t,this}setCache(t){return this.cache=t,this}abort(){return this}};Bc.DEFAULT_MATERIAL_NAME="__DEFAULT";var Ua=class extends Un{static registerNode(t){this.prototype._lightNode=t}constructor(t,e=1){super(),this.isLight=!0,this.type="Light",this.color=new he(t),this.intensity=e}copy(t,e){return super.copy(t,e),this.color.copy(t.color),this.intensity=t.intensity,this}toJSON(t){let e=super.toJSON(t);return e.object.color=this.color.getHex(),e.object.intensity=this.intensity,e}};var Ju=new be,tm=new k,em=new k,kc=class{constructor(t){this.camera=t,this.intensity=1,this.bias=0,this.biasNode=null,this.normalBias=0,this.radius=1,this.blurSamples=8,this.mapSize=new Zt(512,512),this.mapType=oi,this.map=null,this.mapPass=null,this.matrix=new be,this.autoUpdate=!0,this.needsUpdate=!1,this._frustum=new tr,this._frameExtents=new Zt(1,1),this._viewportCount=1,this._viewports=[new Ie(0,0,1,1)]}getViewportCount(){return this._viewportCount}getCamera(){return this.camera}getFrustum(){return this._frustum}updateMatrices(t){let e=this.camera;tm.setFromMatrixPosition(t.matrixWorld),e.position.copy(tm),em.setFromMatrixPosition(t.target.matrixWorld),e.lookAt(em),e.updateMatrixWorld(),this._updateMatrix(e,this.matrix,this._frustum)}_updateMatrix(t,e,n,s){Ju.multiplyMatrices(t.projectionMatrix,t.matrixWorldInverse),n.setFromProjectionMatrix(Ju,t.coordinateSystem,t.reversedDepth);let r=this._frameExtents,o=s?s.z/r.x:1,a=s?s.w/r.y:1,l=s?s.x/r.x:0,c=s?s.y/r.y:0;t.coordinateSystem===Mo||t.reversedDepth?e.set(.5*o,0,0,.5*o+l,0,.5*a,0,.5*a+c,0,0,1,0,0,0,0,1):e.set(.5*o,0,0,.5*o+l,0,.5*a,0,.5*a+c,0,0,.5,.5,0,0,0,1),e.multiply(Ju)}getViewport(t){return this._viewports[t]}getFrameExtents(){return this._frameExtents}dispose(){this.map&&this.map.dispose(),this.mapPass&&this.mapPass.dispose()}copy(t){return this.camera=t.camera.clone(),this.intensity=t.intensity,this.bias=t.bias,this.radius=t.radius,this.autoUpdate=t.autoUpdate,this.needsUpdate=t.needsUpdate,this.normalBias=t.normalBias,this.blurSamples=t.blurSamples,this.mapSize.copy(t.mapSize),this.mapType=t.mapType,this.biasNode=t.biasNode,this}clone(){return new this.constructor().copy(this)}toJSON(){let t={};return t.intensity=this.intensity,t.bias=this.bias,t.normalBias=this.normalBias,t.radius=this.radius,t.blurSamples=this.blurSamples,t.mapSize=this.mapSize.toArray(),t.mapType=this.mapType,t.camera=this.camera.toJSON(!1).object,delete t.camera.matrix,t}},ic=new k,sc=new Je,as=new k,Oa=class extends Un{constructor(){super(),this.isCamera=!0,this.type="Camera",this.matrixWorldInverse=new be,this.projectionMatrix=new be,this.projectionMatrixInverse=new be,this.coordinateSystem=Ei,this._reversedDepth=!1}get reversedDepth(){return this._reversedDepth}copy(t,e){return super.copy(t,e),this.matrixWorldInverse.copy(t.matrixWorldInverse),this.projectionMatrix.copy(t.projectionMatrix),this.projectionMatrixInverse.copy(t.projectionMatrixInverse),this.coordinateSystem=t.coordinateSystem,this}getWorldDirection(t){return super.getWorldDirection(t).negate()}updateMatrixWorld(t){super.updateMatrixWorld(t),this.matrixWorld.decompose(ic,sc,as),as.x===1&&as.y===1&&as.z===1?this.matrixWorldInverse.copy(this.matrixWorld).invert():this.matrixWorldInverse.compose(ic,sc,as.set(1,1,1)).invert()}updateWorldMatrix(t,e,n=!1){super.updateWorldMatrix(t,e,n),this.matrixWorld.decompose(ic,sc,as),as.x===1&&as.y===1&&as.z===1?this.matrixWorldInverse.copy(this.matrixWorld).invert():this.matrixWorldInverse.compose(ic,sc,as.set(1,1,1)).invert()}clone(){return new this.constructor().copy(this)}},Qs=new k,nm=new Zt,im=new Zt,Qn=class extends Oa{constructor(t=50,e=1,n=.1,s=2e3){super(),this.isPerspectiveCamera=!0,this.type="PerspectiveCamera",this.fov=t,this.zoom=1,this.near=n,this.far=s,this.focus=10,this.aspect=e,this.view=null,this.filmGauge=35,this.filmOffset=0,this.updateProjectionMatrix()}copy(t,e){return super.copy(t,e),this.fov=t.fov,this.zoom=t.zoom,this.near=t.near,this.far=t.far,this.focus=t.focus,this.aspect=t.aspect,this.view=t.view===null?null:Object.assign({},t.view),this.filmGauge=t.filmGauge,this.filmOffset=t.filmOffset,this}setFocalLength(t){let e=.5*this.getFilmHeight()/t;this.fov=To*2*Math.atan(e),this.updateProjectionMatrix()}getFocalLength(){let t=Math.tan(vo*.5*this.fov);return .5*this.getFilmHeight()/t}getEffectiveFOV(){return To*2*Math.atan(Math.tan(vo*.5*this.fov)/this.zoom)}getFilmWidth(){return this.filmGauge*Math.min(this.aspect,1)}getFilmHeight(){return this.filmGauge/Math.max(this.aspect,1)}getViewBounds(t,e,n){Qs.set(-1,-1,.5).applyMatrix4(this.projectionMatrixInverse),e.set(Qs.x,Qs.y).multiplyScalar(-t/Qs.z),Qs.set(1,1,.5).applyMatrix4(this.projectionMatrixInverse),n.set(Qs.x,Qs.y).multiplyScalar(-t/Qs.z)}getViewSize(t,e){return this.getViewBounds(t,nm,im),e.subVectors(im,nm)}setViewOffset(t,e,n,s,r,o){this.aspect=t/e,this.view===null&&(this.view={enabled:!0,fullWidth:1,fullHeight:1,offsetX:0,offsetY:0,width:1,height:1}),this.view.enabled=!0,this.view.fullWidth=t,this.view.fullHeight=e,this.view.offsetX=n,this.view.offsetY=s,this.view.width=r,this.view.height=o,this.updateProjectionMatrix()}clearViewOffset(){this.view!==null&&(this.view.enabled=!1),this.updateProjectionMatrix()}updateProjectionMatrix(){let t=this.near,e=t*Math.tan(vo*.5*this.fov)/this.zoom,n=2*e,s=this.aspect*n,r=-.5*s,o=this.view;if(this.view!==null&&this.view.enabled){let l=o.fullWidth,c=o.fullHeight;r+=o.offsetX*s/l,e-=o.offsetY*n/c,s*=o.width/l,n*=o.height/c}let a=this.filmOffset;a!==0&&(r+=t*a/this.getFilmWidth()),this.projectionMatrix.makePerspective(r,r+s,e,e-n,t,this.far,this.coordinateSystem,this.reversedDepth),this.projectionMatrixInverse.copy(this.projectionMatrix).invert()}toJSON(t){let e=super.toJSON(t);return e.object.fov=this.fov,e.object.zoom=this.zoom,e.object.near=this.near,e.object.far=this.far,e.object.focus=this.focus,e.object.aspect=this.aspect,this.view!==null&&(e.object.view=Object.assign({},this.view)),e.object.filmGauge=this.filmGauge,e.object.filmOffset=this.filmOffset,e}};var Fa=class extends Oa{constructor(t=-1,e=1,n=1,s=-1,r=.1,o=2e3){super(),this.isOrthographicCamera=!0,this.type="OrthographicCamera",this.zoom=1,this.view=null,this.left=t,this.right=e,this.top=n,this.bottom=s,this.near=r,this.far=o,this.updateProjectionMatrix()}copy(t,e){return super.copy(t,e),this.left=t.left,this.right=t.right,this.top=t.top,this.bottom=t.bottom,this.near=t.near,this.far=t.far,this.zoom=t.zoom,this.view=t.view===null?null:Object.assign({},t.view),this}setViewOffset(t,e,n,s,r,o){this.view===null&&(this.view={enabled:!0,fullWidth:1,fullHeight:1,offsetX:0,offsetY:0,width:1,height:1}),this.view.enabled=!0,this.view.fullWidth=t,this.view.fullHeight=e,this.view.offsetX=n,this.view.offsetY=s,this.view.width=r,this.view.height=o,this.updateProjectionMatrix()}clearViewOffset(){this.view!==null&&(this.view.enabled=!1),this.updateProjectionMatrix()}updateProjectionMatrix(){let t=(this.right-this.left)/(2*this.zoom),e=(this.top-this.bottom)/(2*this.zoom),n=(this.right+this.left)/2,s=(this.top+this.bottom)/2,r=n-t,o=n+t,a=s+e,l=s-e;if(this.view!==null&&this.view.enabled){let c=(this.right-this.left)/this.view.fullWidth/this.zoom,u=(this.top-this.bottom)/this.view.fullHeight/this.zoom;r+=c*this.view.offsetX,o=r+c*this.view.width,a-=u*this.view.offsetY,l=a-u*this.view.height}this.projectionMatrix.makeOrthographic(r,o,a,l,this.near,this.far,this.coordinateSystem,this.reversedDepth),this.projectionMatrixInverse.copy(this.projectionMatrix).invert()}toJSON(t){let e=super.toJSON(t);return e.object.zoom=this.zoom,e.object.left=this.left,e.object.right=this.right,e.object.top=this.top,e.object.bottom=this.bottom,e.object.near=this.near,e.object.far=this.far,this.view!==null&&(e.object.view=Object.assign({},this.view)),e}},sd=class extends kc{constructor(){super(new Fa(-5,5,5,-5,.5,500)),this.isDirectionalLightShadow=!0}},Ba=class extends Ua{constructor(t,e){super(t,e),this.isDirectionalLight=!0,this.type="DirectionalLight",this.position.copy(Un.DEFAULT_UP),this.updateMatrix(),this.target=new Un,this.shadow=new sd}dispose(){super.dispose(),this.shadow.dispose()}copy(t){return super.copy(t),this.target=t.target.clone(),this.shadow=t.shadow.clone(),this}toJSON(t){let e=super.toJSON(t);return e.object.shadow=this.shadow.toJSON(),e.object.target=this.target.uuid,e}},ka=class extends Ua{constructor(t,e){super(t,e),this.isAmbientLight=!0,this.type="AmbientLight"}};var za=class extends gn{constructor(){super(),this.isInstancedBufferGeometry=!0,this.type="InstancedBufferGeometry",this.instanceCount=1/0}copy(t){return super.copy(t),this.instanceCount=t.instanceCount,this}toJSON(){let t=super.toJSON();return t.instanceCount=this.instanceCount,t.isInstancedBufferGeometry=!0,t}};var go=-90,_o=1,Uo=class extends Un{constructor(t,e,n){super(),this.type="CubeCamera",this.renderTarget=n,this.coordinateSystem=null,this.activeMipmapLevel=0;let s=new Qn(go,_o,t,e);s.layers=this.layers,this.add(s);let r=new Qn(go,_o,t,e);r.layers=this.layers,this.add(r);let o=new Qn(go,_o,t,e);o.layers=this.layers,this.add(o);let a=new Qn(go,_o,t,e);a.layers=this.layers,this.add(a);let l=new Qn(go,_o,t,e);l.layers=this.layers,this.add(l);let c=new Qn(go,_o,t,e);c.layers=this.layers,this.add(c)}updateCoordinateSystem(){let t=this.coordinateSystem,e=this.children.concat(),[n,s,r,o,a,l]=e;for(let c of e)this.remove(c);if(t===Ei)n.up.set(0,1,0),n.lookAt(1,0,0),s.up.set(0,1,0),s.lookAt(-1,0,0),r.up.set(0,0,-1),r.lookAt(0,1,0),o.up.set(0,0,1),o.lookAt(0,-1,0),a.up.set(0,1,0),a.lookAt(0,0,1),l.up.set(0,1,0),l.lookAt(0,0,-1);else if(t===Mo)n.up.set(0,-1,0),n.lookAt(-1,0,0),s.up.set(0,-1,0),s.lookAt(1,0,0),r.up.set(0,0,1),r.lookAt(0,1,0),o.up.set(0,0,-1),o.lookAt(0,-1,0),a.up.set(0,-1,0),a.lookAt(0,0,1),l.up.set(0,-1,0),l.lookAt(0,0,-1);else throw new Error("THREE.CubeCamera.updateCoordinateSystem(): Invalid coordinate system: "+t);for(let c of e)this.add(c),c.updateMatrixWorld()}update(t,e){this.parent===null&&this.updateMatrixWorld();let{renderTarget:n,activeMipmapLevel:s}=this;this.coordinateSystem!==t.coordinateSystem&&(this.coordinateSystem=t.coordinateSystem,this.updateCoordinateSystem());let[r,o,a,l,c,u]=this.children,h=t.getRenderTarget(),d=t.getActiveCubeFace(),f=t.getActiveMipmapLevel(),m=t.xr.enabled;t.xr.enabled=!1;let y=n.texture.mipmapsAutoUpdate;n.texture.mipmapsAutoUpdate=!1;let p=!1;t.isWebGLRenderer===!0?p=t.state.buffers.depth.getReversed():p=t.reversedDepthBuffer,t.setRenderTarget(n,0,s),p&&t.autoClear===!1&&t.clearDepth(),t.render(e,r),t.setRenderTarget(n,1,s),p&&t.autoClear===!1&&t.clearDepth(),t.render(e,o),t.setRenderTarget(n,2,s),p&&t.autoClear===!1&&t.clearDepth(),t.render(e,a),t.setRenderTarget(n,3,s),p&&t.autoClear===!1&&t.clearDepth(),t.render(e,l),t.setRenderTarget(n,4,s),p&&t.autoClear===!1&&t.clearDepth(),t.render(e,c),n.texture.mipmapsAutoUpdate=y,t.setRenderTarget(n,5,s),p&&t.autoClear===!1&&t.clearDepth(),t.render(e,u),t.setRenderTarget(h,d,f),t.xr.enabled=m,n.texture.needsPMREMUpdate=!0}},zc=class extends Qn{constructor(t=[]){super(),this.isArrayCamera=!0,this.isMultiViewCamera=!1,this.cameras=t,this.perCameraFrustumCulled=!1}};var kd="\\[\\]\\.:\\/",Wx=new RegExp("["+kd+"]","g"),zd="[^"+kd+"]",Xx="[^"+kd.replace("\\.","")+"]",qx=/((?:WC+[\/:])*)/.source.replace("WC",zd),Yx=/(WCOD+)?/.source.replace("WCOD",Xx),$x=/(?:\.(WC+)(?:\[(.+)\])?)?/.source.replace("WC",zd),Kx=/\.(WC+)(?:\[(.+)\])?/.source.replace("WC",zd),Zx=new RegExp("^"+qx+Yx+$x+Kx+"$"),Jx=["material","materials","bones","map"],rd=class{constructor(t,e,n){let s=n||qe.parseTrackName(e);this._targetGroup=t,this._bindings=t.subscribe_(e,s)}getValue(t,e){this.bind();let n=this._targetGroup.nCachedObjects_,s=this._bindings[n];s!==void 0&&s.getValue(t,e)}setValue(t,e){let n=this._bindings;for(let s=this._targetGroup.nCachedObjects_,r=n.length;s!==r;++s)n[s].setValue(t,e)}bind(){let t=this._bindings;for(let e=this._targetGroup.nCachedObjects_,n=t.length;e!==n;++e)t[e].bind()}unbind(){let t=this._bindings;for(let e=this._targetGroup.nCachedObjects_,n=t.length;e!==n;++e)t[e].unbind()}},qe=class i{constructor(t,e,n){this.path=e,this.parsedPath=n||i.parseTrackName(e),this.node=i.findNode(t,this.parsedPath.nodeName),this.rootNode=t,this.getValue=this._getValue_unbound,this.setValue=this._setValue_unbound}static create(t,e,n){return t&&t.isAnimationObjectGroup?new i.Composite(t,e,n):new i(t,e,n)}static sanitizeNodeName(t){return t.replace(/\s/g,"_").replace(Wx,"")}static parseTrackName(t){let e=Zx.exec(t);if(e===null)throw new Error("THREE.PropertyBinding: Cannot parse trackName: "+t);let n={nodeName:e[2],objectName:e[3],objectIndex:e[4],propertyName:e[5],propertyIndex:e[6]},s=n.nodeName&&n.nodeName.lastIndexOf(".");if(s!==void 0&&s!==-1){let r=n.nodeName.substring(s+1);Jx.indexOf(r)!==-1&&(n.nodeName=n.nodeName.substring(0,s),n.objectName=r)}if(n.propertyName===null||n.propertyName.length===0)throw new Error("THREE.PropertyBinding: can not parse propertyName from trackName: "+t);return n}static findNode(t,e){if(e===void 0||e===""||e==="."||e===-1||e===t.name||e===t.uuid)return t;if(t.skeleton){let n=t.skeleton.getBoneByName(e);if(n!==void 0)return n}if(t.children){let n=function(r){for(let o=0;o<r.length;o++){let a=r[o];if(a.name===e||a.uuid===e)return a;let l=n(a.children);if(l)return l}return null},s=n(t.children);if(s)return s}return null}_getValue_unavailable(){}_setValue_unavailable(){}_getValue_direct(t,e){t[e]=this.targetObject[this.propertyName]}_getValue_array(t,e){let n=this.resolvedProperty;for(let s=0,r=n.length;s!==r;++s)t[e++]=n[s]}_getValue_arrayElement(t,e){t[e]=this.resolvedProperty[this.propertyIndex]}_getValue_toArray(t,e){this.resolvedProperty.toArray(t,e)}_setValue_direct(t,e){this.targetObject[this.propertyName]=t[e]}_setValue_direct_setNeedsUpdate(t,e){this.targetObject[this.propertyName]=t[e],this.targetObject.needsUpdate=!0}_setValue_direct_setMatrixWorldNeedsUpdate(t,e){this.targetObject[this.propertyName]=t[e],this.targetObject.matrixWorldNeedsUpdate=!0}_setValue_array(t,e){let n=this.resolvedProperty;for(let s=0,r=n.length;s!==r;++s)n[s]=t[e++]}_setValue_array_setNeedsUpdate(t,e){let n=this.resolvedProperty;for(let s=0,r=n.length;s!==r;++s)n[s]=t[e++];this.targetObject.needsUpdate=!0}_setValue_array_setMatrixWorldNeedsUpdate(t,e){let n=this.resolvedProperty;for(let s=0,r=n.length;s!==r;++s)n[s]=t[e++];this.targetObject.matrixWorldNeedsUpdate=!0}_setValue_arrayElement(t,e){this.resolvedProperty[this.propertyIndex]=t[e]}_setValue_arrayElement_setNeedsUpdate(t,e){this.resolvedProperty[this.propertyIndex]=t[e],this.targetObject.needsUpdate=!0}_setValue_arrayElement_setMatrixWorldNeedsUpdate(t,e){this.resolvedProperty[this.propertyIndex]=t[e],this.targetObject.matrixWorldNeedsUpdate=!0}_setValue_fromArray(t,e){this.resolvedProperty.fromArray(t,e)}_setValue_fromArray_setNeedsUpdate(t,e){this.resolvedProperty.fromArray(t,e),this.targetObject.needsUpdate=!0}_setValue_fromArray_setMatrixWorldNeedsUpdate(t,e){this.resolvedProperty.fromArray(t,e),this.targetObject.matrixWorldNeedsUpdate=!0}_getValue_unbound(t,e){this.bind(),this.getValue(t,e)}_setValue_unbound(t,e){this.bind(),this.setValue(t,e)}bind(){let t=this.node,e=this.parsedPath,n=e.objectName,s=e.propertyName,r=e.propertyIndex;if(t||(t=i.findNode(this.rootNode,e.nodeName),this.node=t),this.getValue=this._getValue_unavailable,this.setValue=this._setValue_unavailable,!t){$t("PropertyBinding: No target node found for track: "+this.path+".");return}if(n){let c=e.objectIndex;switch(n){case"materials":if(!t.material){ee("PropertyBinding: Can not bind to material as node does not have a material.",this);return}if(!t.material.materials){ee("PropertyBinding: Can not bind to material.materials as node.material does not have a materials array.",this);return}t=t.material.materials;break;case"bones":if(!t.skeleton){ee("PropertyBinding: Can not bind to bones as node does not have a skeleton.",this);return}t=t.skeleton.bones;for(let u=0;u<t.length;u++)if(t[u].name===c){c=u;break}break;case"map":if("map"in t){t=t.map;break}if(!t.material){ee("PropertyBinding: Can not bind to material as node does not have a material.",this);return}if(!t.material.map){ee("PropertyBinding: Can not bind to material.map as node.material does not have a map.",this);return}t=t.material.map;break;default:if(t[n]===void 0){ee("PropertyBinding: Can not bind to objectName of node undefined.",this);return}t=t[n]}if(c!==void 0){if(t[c]===void 0){ee("PropertyBinding: Trying to bind to objectIndex of objectName, but is undefined.",this,t);return}t=t[c]}}let o=t[s];if(o===void 0){let c=e.nodeName;ee("PropertyBinding: Trying to update property for track: "+c+"."+s+" but it wasn't found.",t);return}let a=this.Versioning.None;this.targetObject=t,t.isMaterial===!0?a=this.Versioning.NeedsUpdate:t.isObject3D===!0&&(a=this.Versioning.MatrixWorldNeedsUpdate);let l=this.BindingType.Direct;if(r!==void 0){if(s==="morphTargetInfluences"){if(!t.geometry){ee("PropertyBinding: Can not bind to morphTargetInfluences because node does not have a geometry.",this);return}if(!t.geometry.morphAttributes){ee("PropertyBinding: Can not bind to morphTargetInfluences because node does not have a geometry.morphAttributes.",this);return}t.morphTargetDictionary[r]!==void 0&&(r=t.morphTargetDictionary[r])}l=this.BindingType.ArrayElement,this.resolvedProperty=o,this.propertyIndex=r}else o.fromArray!==void 0&&o.toArray!==void 0?(l=this.BindingType.HasFromToArray,this.resolvedProperty=o):Array.isArray(o)?(l=this.BindingType.EntireArray,this.resolvedProperty=o):this.propertyName=s;this.getValue=this.GetterByBindingType[l],this.setValue=this.SetterByBindingTypeAndVersioning[l][a]}unbind(){this.node=null,this.getValue=this._getValue_unbound,this.setValue=this._setValue_unbound}};qe.Composite=rd;qe.prototype.BindingType={Direct:0,EntireArray:1,ArrayElement:2,HasFromToArray:3};qe.prototype.Versioning={None:0,NeedsUpdate:1,MatrixWorldNeedsUpdate:2};qe.prototype.GetterByBindingType=[qe.prototype._getValue_direct,qe.prototype._getValue_array,qe.prototype._getValue_arrayElement,qe.prototype._getValue_toArray];qe.prototype.SetterByBindingTypeAndVersioning=[[qe.prototype._setValue_direct,qe.prototype._setValue_direct_setNeedsUpdate,qe.prototype._setValue_direct_setMatrixWorldNeedsUpdate],[qe.prototype._setValue_array,qe.prototype._setValue_array_setNeedsUpdate,qe.prototype._setValue_array_setMatrixWorldNeedsUpdate],[qe.prototype._setValue_arrayElement,qe.prototype._setValue_arrayElement_setNeedsUpdate,qe.prototype._setValue_arrayElement_setMatrixWorldNeedsUpdate],[qe.prototype._setValue_fromArray,qe.prototype._setValue_fromArray_setNeedsUpdate,qe.prototype._setValue_fromArray_setMatrixWorldNeedsUpdate]];var _E=new Float32Array(1);var rr=class extends Sc{constructor(t,e,n=1){super(t,e),this.isInstancedInterleavedBuffer=!0,this.meshPerAttribute=n}copy(t){return super.copy(t),this.meshPerAttribute=t.meshPerAttribute,this}clone(t){let e=super.clone(t);return e.meshPerAttribute=this.meshPerAttribute,e}toJSON(t){let e=super.toJSON(t);return e.isInstancedInterleavedBuffer=!0,e.meshPerAttribute=this.meshPerAttribute,e}};var sm=new be,Va=class{constructor(t,e,n=0,s=1/0){this.ray=new Ls(t,e),this.near=n,this.far=s,this.camera=null,this.layers=new Eo,this.params={Mesh:{},Line:{threshold:1},LOD:{},Points:{threshold:1},Sprite:{}}}set(t,e){this.ray.set(t,e)}setFromCamera(t,e){e.isPerspectiveCamera?(this.ray.origin.setFromMatrixPosition(e.matrixWorld),this.ray.direction.set(t.x,t.y,.5).unproject(e).sub(this.ray.origin).normalize(),this.camera=e):e.isOrthographicCamera?(this.ray.origin.set(t.x,t.y,e.projectionMatrix.elements[14]).unproject(e),this.ray.direction.set(0,0,-1).transformDirection(e.matrixWorld),this.camera=e):ee("Raycaster: Unsupported camera type: "+e.type)}setFromXRController(t){return sm.identity().extractRotation(t.matrixWorld),this.ray.origin.setFromMatrixPosition(t.matrixWorld),this.ray.direction.set(0,0,-1).applyMatrix4(sm),this}intersectObject(t,e=!0,n=[]){return od(t,this,n,e),n.sort(rm),n}intersectObjects(t,e=!0,n=[]){for(let s=0,r=t.length;s<r;s++)od(t[s],this,n,e);return n.sort(rm),n}};function rm(i,t){return i.distance-t.distance}function od(i,t,e,n){let s=!0;if(i.layers.test(t.layers)&&i.raycast(t,e)===!1&&(s=!1),s===!0&&n===!0){let r=i.children;for(let o=0,a=r.length;o<a;o++)od(r[o],t,e,!0)}}var Oo=class{constructor(t=1,e=0,n=0){this.radius=t,this.phi=e,this.theta=n}set(t,e,n){return this.radius=t,this.phi=e,this.theta=n,this}copy(t){return this.radius=t.radius,this.phi=t.phi,this.theta=t.theta,this}makeSafe(){return this.phi=le(this.phi,1e-6,Math.PI-1e-6),this}setFromVector3(t){return this.setFromCartesianCoords(t.x,t.y,t.z)}setFromCartesianCoords(t,e,n){return this.radius=Math.sqrt(t*t+e*e+n*n),this.radius===0?(this.theta=0,this.phi=0):(this.theta=Math.atan2(t,n),this.phi=Math.acos(le(e/this.radius,-1,1))),this}clone(){return new this.constructor().copy(this)}};var ad=class{static{this.prototype.isMatrix2=!0}constructor(t,e,n,s){this.elements=[1,0,0,1],t!==void 0&&this.set(t,e,n,s)}identity(){return this.set(1,0,0,1),this}fromArray(t,e=0){for(let n=0;n<4;n++)this.elements[n]=t[n+e];return this}set(t,e,n,s){let r=this.elements;return r[0]=t,r[2]=e,r[1]=n,r[3]=s,this}};var om=new k,rc=new k,xo=new k,yo=new k,ju=new k,jx=new k,Qx=new k,Ga=class{constructor(t=new k,e=new k){this.start=t,this.end=e}set(t,e){return this.start.copy(t),this.end.copy(e),this}copy(t){return this.start.copy(t.start),this.end.copy(t.end),this}getCenter(t){return t.addVectors(this.start,this.end).multiplyScalar(.5)}delta(t){return t.subVectors(this.end,this.start)}distanceSq(){return this.start.distanceToSquared(this.end)}distance(){return this.start.distanceTo(this.end)}at(t,e){return this.delta(e).multiplyScalar(t).add(this.start)}closestPointToPointParameter(t,e){om.subVectors(t,this.start),rc.subVectors(this.end,this.start);let n=rc.dot(rc);if(n===0)return 0;let r=rc.dot(om)/n;return e&&(r=le(r,0,1)),r}closestPointToPoint(t,e,n){let s=this.closestPointToPointParameter(t,e);return this.delta(n).multiplyScalar(s).add(this.start)}distanceSqToLine3(t,e=jx,n=Qx){let s=10000000000000001e-32,r,o,a=this.start,l=t.start,c=this.end,u=t.end;xo.subVectors(c,a),yo.subVectors(u,l),ju.subVectors(a,l);let h=xo.dot(xo),d=yo.dot(yo),f=yo.dot(ju);if(h<=s&&d<=s)return e.copy(a),n.copy(l),e.distanceToSquared(n);if(h<=s)r=0,o=f/d,o=le(o,0,1);else{let m=xo.dot(ju);if(d<=s)o=0,r=le(-m/h,0,1);else{let y=xo.dot(yo),p=h*d-y*y;p!==0?r=le((y*f-m*d)/p,0,1):r=0,o=(y*r+f)/d,o<0?(o=0,r=le(-m/h,0,1)):o>1&&(o=1,r=le((y-m)/h,0,1))}}return e.copy(a).addScaledVector(xo,r),n.copy(l).addScaledVector(yo,o),e.distanceToSquared(n)}applyMatrix4(t){return this.start.applyMatrix4(t),this.end.applyMatrix4(t),this}equals(t){return t.start.equals(this.start)&&t.end.equals(this.end)}clone(){return new this.constructor().copy(this)}};var Ha=class extends zi{constructor(t,e=null){super(),this.object=t,this.domElement=e,this.enabled=!0,this.state=-1,this.keys={},this.mouseButtons={LEFT:null,MIDDLE:null,RIGHT:null},this.touches={ONE:null,TWO:null}}connect(t){this.domElement!==null&&this.disconnect(),this.domElement=t}disconnect(){}dispose(){}update(){}};function Vd(i,t,e,n){let s=ty(n);switch(e){case Ad:return i*t;case Cd:return i*t/s.components*s.byteLength;case $c:return i*t/s.components*s.byteLength;case cr:return i*t*2/s.components*s.byteLength;case Kc:return i*t*2/s.components*s.byteLength;case Ed:return i*t*3/s.components*s.byteLength;case Xi:return i*t*4/s.components*s.byteLength;case Zc:return i*t*4/s.components*s.byteLength;case qa:case Ya:return Math.floor((i+3)/4)*Math.floor((t+3)/4)*8;case $a:case Ka:return Math.floor((i+3)/4)*Math.floor((t+3)/4)*16;case jc:case th:return Math.max(i,16)*Math.max(t,8)/4;case Jc:case Qc:return Math.max(i,8)*Math.max(t,8)/2;case eh:case nh:case sh:case rh:return Math.floor((i+3)/4)*Math.floor((t+3)/4)*8;case ih:case Za:case oh:return Math.floor((i+3)/4)*Math.floor((t+3)/4)*16;case ah:return Math.floor((i+3)/4)*Math.floor((t+3)/4)*16;case lh:return Math.floor((i+4)/5)*Math.floor((t+3)/4)*16;case ch:return Math.floor((i+4)/5)*Math.floor((t+4)/5)*16;case hh:return Math.floor((i+5)/6)*Math.floor((t+4)/5)*16;case uh:return Math.floor((i+5)/6)*Math.floor((t+5)/6)*16;case dh:return Math.floor((i+7)/8)*Math.floor((t+4)/5)*16;case fh:return Math.floor((i+7)/8)*Math.floor((t+5)/6)*16;case ph:return Math.floor((i+7)/8)*Math.floor((t+7)/8)*16;case mh:return Math.floor((i+9)/10)*Math.floor((t+4)/5)*16;case gh:return Math.floor((i+9)/10)*Math.floor((t+5)/6)*16;case _h:return Math.floor((i+9)/10)*Math.floor((t+7)/8)*16;case xh:return Math.floor((i+9)/10)*Math.floor((t+9)/10)*16;case yh:return Math.floor((i+11)/12)*Math.floor((t+9)/10)*16;case vh:return Math.floor((i+11)/12)*Math.floor((t+11)/12)*16;case Sh:case bh:case Mh:return Math.ceil(i/4)*Math.ceil(t/4)*16;case wh:case Th:return Math.ceil(i/4)*Math.ceil(t/4)*8;case Ja:case Ah:return Math.ceil(i/4)*Math.ceil(t/4)*16}throw new Error(`Unable to determine texture byte length for ${e} format.`)}function ty(i){switch(i){case oi:case bd:return{byteLength:1,components:1};case zo:case Md:case Wi:return{byteLength:2,components:1};case qc:case Yc:return{byteLength:2,components:4};case Gi:case Xc:case Hi:return{byteLength:4,components:1};case wd:case Td:return{byteLength:4,components:3}}throw new Error(`THREE.TextureUtils: Unknown texture type ${i}.`)}typeof __THREE_DEVTOOLS__<"u"&&__THREE_DEVTOOLS__.dispatchEvent(new CustomEvent("register",{detail:{revision:"187"}}));typeof window<"u"&&(window.__THREE__?$t("WARNING: Multiple instances of Three.js being imported."):window.__THREE__="187");function fg(){let i=null,t=!1,e=null,n=null;function s(r,o){n=i.requestAnimationFrame(s),e(r,o)}return{start:function(){t!==!0&&e!==null&&i!==null&&(n=i.requestAnimationFrame(s),t=!0)},stop:function(){i!==null&&i.cancelAnimationFrame(n),t=!1},setAnimationLoop:function(r){e=r},setContext:function(r){i=r}}}function ny(i){let t=new WeakMap;function e(a,l){let c=a.array,u=a.usage,h=c.byteLength,d=i.createBuffer();i.bindBuffer(l,d),i.bufferData(l,c,u),a.onUploadCallback();let f;if(c instanceof Float32Array)f=i.FLOAT;else if(typeof Float16Array<"u"&&c instanceof Float16Array)f=i.HALF_FLOAT;else if(c instanceof Uint16Array)a.isFloat16BufferAttribute?f=i.HALF_FLOAT:f=i.UNSIGNED_SHORT;else if(c instanceof Int16Array)f=i.SHORT;else if(c instanceof Uint32Array)f=i.UNSIGNED_INT;else if(c instanceof Int32Array)f=i.INT;else if(c instanceof Int8Array)f=i.BYTE;else if(c instanceof Uint8Array)f=i.UNSIGNED_BYTE;else if(c instanceof Uint8ClampedArray)f=i.UNSIGNED_BYTE;else throw new Error("THREE.WebGLAttributes: Unsupported buffer data format: "+c);return{buffer:d,type:f,bytesPerElement:c.BYTES_PER_ELEMENT,version:a.version,size:h}}function n(a,l,c){let u=l.array,h=l.updateRanges;if(i.bindBuffer(c,a),h.length===0)i.bufferSubData(c,0,u);else{h.sort((f,m)=>f.start-m.start);let d=0;for(let f=1;f<h.length;f++){let m=h[d],y=h[f];y.start<=m.start+m.count+1?m.count=Math.max(m.count,y.start+y.count-m.start):(++d,h[d]=y)}h.length=d+1;for(let f=0,m=h.length;f<m;f++){let y=h[f];i.bufferSubData(c,y.start*u.BYTES_PER_ELEMENT,u,y.start,y.count)}l.clearUpdateRanges()}l.onUploadCallback()}function s(a){return a.isInterleavedBufferAttribute&&(a=a.data),t.get(a)}function r(a){a.isInterleavedBufferAttribute&&(a=a.data);let l=t.get(a);l&&(i.deleteBuffer(l.buffer),t.delete(a))}function o(a,l){if(a.isInterleavedBufferAttribute&&(a=a.data),a.isGLBufferAttribute){let u=t.get(a);(!u||u.version<a.version)&&t.set(a,{buffer:a.buffer,type:a.type,bytesPerElement:a.elementSize,version:a.version});return}let c=t.get(a);if(c===void 0)t.set(a,e(a,l));else if(c.version<a.version){if(c.size!==a.array.byteLength)throw new Error("THREE.WebGLAttributes: The size of the buffer attribute's array buffer does not match the original size. Resizing buffer attributes is not supported.");n(c.buffer,a,l),c.version=a.version}}return{get:s,remove:r,update:o}}var iy=`#ifdef USE_ALPHAHASH
	if ( diffuseColor.a < getAlphaHashThreshold( vPosition ) ) discard;
#endif`,sy=`#ifdef USE_ALPHAHASH
	const float ALPHA_HASH_SCALE = 0.05;
	float hash2D( vec2 value ) {
		return fract( 1.0e4 * sin( 17.0 * value.x + 0.1 * value.y ) * ( 0.1 + abs( sin( 13.0 * value.y + value.x ) ) ) );
	}
	float hash3D( vec3 value ) {
		return hash2D( vec2( hash2D( value.xy ), value.z ) );
	}
	float getAlphaHashThreshold( vec3 position ) {
		float maxDeriv = max(
			length( dFdx( position.xyz ) ),
			length( dFdy( position.xyz ) )
		);
		float pixScale = 1.0 / ( ALPHA_HASH_SCALE * maxDeriv );
		vec2 pixScales = vec2(
			exp2( floor( log2( pixScale ) ) ),
			exp2( ceil( log2( pixScale ) ) )
		);
		vec2 alpha = vec2(
			hash3D( floor( pixScales.x * position.xyz ) ),
			hash3D( floor( pixScales.y * position.xyz ) )
		);
		float lerpFactor = fract( log2( pixScale ) );
		float x = ( 1.0 - lerpFactor ) * alpha.x + lerpFactor * alpha.y;
		float a = min( lerpFactor, 1.0 - lerpFactor );
		vec3 cases = vec3(
			x * x / ( 2.0 * a * ( 1.0 - a ) ),
			( x - 0.5 * a ) / ( 1.0 - a ),
			1.0 - ( ( 1.0 - x ) * ( 1.0 - x ) / ( 2.0 * a * ( 1.0 - a ) ) )
		);
		float threshold = ( x < ( 1.0 - a ) )
			? ( ( x < a ) ? cases.x : cases.y )
			: cases.z;
		return clamp( threshold , 1.0e-6, 1.0 );
	}
#endif`,ry=`#ifdef USE_ALPHAMAP
	diffuseColor.a *= texture2D( alphaMap, vAlphaMapUv ).g;
#endif`,oy=`#ifdef USE_ALPHAMAP
	uniform sampler2D alphaMap;
#endif`,ay=`#ifdef USE_ALPHATEST
	#ifdef ALPHA_TO_COVERAGE
	diffuseColor.a = smoothstep( alphaTest, alphaTest + fwidth( diffuseColor.a ), diffuseColor.a );
	if ( diffuseColor.a == 0.0 ) discard;
	#else
	if ( diffuseColor.a < alphaTest ) discard;
	#endif
#endif`,ly=`#ifdef USE_ALPHATEST
	uniform float alphaTest;
#endif`,cy=`#ifdef USE_AOMAP
	float ambientOcclusion = ( texture2D( aoMap, vAoMapUv ).r - 1.0 ) * aoMapIntensity + 1.0;
	reflectedLight.indirectDiffuse *= ambientOcclusion;
	#if defined( USE_CLEARCOAT ) 
		clearcoatSpecularIndirect *= ambientOcclusion;
	#endif
	#if defined( USE_SHEEN ) 
		sheenSpecularIndirect *= ambientOcclusion;
	#endif
	#if defined( USE_ENVMAP ) && defined( STANDARD )
		float dotNV = saturate( dot( geometryNormal, geometryViewDir ) );
		reflectedLight.indirectSpecular *= computeSpecularOcclusion( dotNV, ambientOcclusion, material.roughness );
	#endif
#endif`,hy=`#ifdef USE_AOMAP
	uniform sampler2D aoMap;
	uniform float aoMapIntensity;
#endif`,uy=`#ifdef USE_BATCHING
	#if ! defined( GL_ANGLE_multi_draw )
	#define gl_DrawID _gl_DrawID
	uniform int _gl_DrawID;
	#endif
	uniform highp sampler2D batchingTexture;
	uniform highp usampler2D batchingIdTexture;
	mat4 getBatchingMatrix( const in float i ) {
		int size = textureSize( batchingTexture, 0 ).x;
		int j = int( i ) * 4;
		int x = j % size;
		int y = j / size;
		vec4 v1 = texelFetch( batchingTexture, ivec2( x, y ), 0 );
		vec4 v2 = texelFetch( batchingTexture, ivec2( x + 1, y ), 0 );
		vec4 v3 = texelFetch( batchingTexture, ivec2( x + 2, y ), 0 );
		vec4 v4 = texelFetch( batchingTexture, ivec2( x + 3, y ), 0 );
		return mat4( v1, v2, v3, v4 );
	}
	float getIndirectIndex( const in int i ) {
		int size = textureSize( batchingIdTexture, 0 ).x;
		int x = i % size;
		int y = i / size;
		return float( texelFetch( batchingIdTexture, ivec2( x, y ), 0 ).r );
	}
#endif
#ifdef USE_BATCHING_COLOR
	uniform sampler2D batchingColorTexture;
	vec4 getBatchingColor( const in float i ) {
		int size = textureSize( batchingColorTexture, 0 ).x;
		int j = int( i );
		int x = j % size;
		int y = j / size;
		return texelFetch( batchingColorTexture, ivec2( x, y ), 0 );
	}
#endif`,dy=`#ifdef USE_BATCHING
	mat4 batchingMatrix = getBatchingMatrix( getIndirectIndex( gl_DrawID ) );
#endif`,fy=`vec3 transformed = vec3( position );
#ifdef USE_ALPHAHASH
	vPosition = vec3( position );
#endif`,py=`vec3 objectNormal = vec3( normal );
#ifdef USE_TANGENT
	vec3 objectTangent = vec3( tangent.xyz );
#endif`,my=`float G_BlinnPhong_Implicit( ) {
	return 0.25;
}
float D_BlinnPhong( const in float shininess, const in float dotNH ) {
	return RECIPROCAL_PI * ( shininess * 0.5 + 1.0 ) * pow( dotNH, shininess );
}
vec3 BRDF_BlinnPhong( const in vec3 lightDir, const in vec3 viewDir, const in vec3 normal, const in vec3 specularColor, const in float shininess ) {
	vec3 halfDir = normalize( lightDir + viewDir );
	float dotNH = saturate( dot( normal, halfDir ) );
	float dotVH = saturate( dot( viewDir, halfDir ) );
	vec3 F = F_Schlick( specularColor, 1.0, dotVH );
	float G = G_BlinnPhong_Implicit( );
	float D = D_BlinnPhong( shininess, dotNH );
	return F * ( G * D );
} // validated`,gy=`#ifdef USE_IRIDESCENCE
	const mat3 XYZ_TO_REC709 = mat3(
		 3.2404542, -0.9692660,  0.0556434,
		-1.5371385,  1.8760108, -0.2040259,
		-0.4985314,  0.0415560,  1.0572252
	);
	vec3 Fresnel0ToIor( vec3 fresnel0 ) {
		vec3 sqrtF0 = sqrt( fresnel0 );
		return ( vec3( 1.0 ) + sqrtF0 ) / ( vec3( 1.0 ) - sqrtF0 );
	}
	vec3 IorToFresnel0( vec3 transmittedIor, float incidentIor ) {
		return pow2( ( transmittedIor - vec3( incidentIor ) ) / ( transmittedIor + vec3( incidentIor ) ) );
	}
	float IorToFresnel0( float transmittedIor, float incidentIor ) {
		return pow2( ( transmittedIor - incidentIor ) / ( transmittedIor + incidentIor ));
	}
	vec3 evalSensitivity( float OPD, vec3 shift ) {
		float phase = 2.0 * PI * OPD * 1.0e-9;
		vec3 val = vec3( 5.4856e-13, 4.4201e-13, 5.2481e-13 );
		vec3 pos = vec3( 1.6810e+06, 1.7953e+06, 2.2084e+06 );
		vec3 var = vec3( 4.3278e+09, 9.3046e+09, 6.6121e+09 );
		vec3 xyz = val * sqrt( 2.0 * PI * var ) * cos( pos * phase + shift ) * exp( - pow2( phase ) * var );
		xyz.x += 9.7470e-14 * sqrt( 2.0 * PI * 4.5282e+09 ) * cos( 2.2399e+06 * phase + shift[ 0 ] ) * exp( - 4.5282e+09 * pow2( phase ) );
		xyz /= 1.0685e-7;
		vec3 rgb = XYZ_TO_REC709 * xyz;
		return rgb;
	}
	vec3 evalIridescence( float outsideIOR, float eta2, float cosTheta1, float thinFilmThickness, vec3 baseF0 ) {
		vec3 I;
		float iridescenceIOR = mix( outsideIOR, eta2, smoothstep( 0.0, 0.03, thinFilmThickness ) );
		float sinTheta2Sq = pow2( outsideIOR / iridescenceIOR ) * ( 1.0 - pow2( cosTheta1 ) );
		float cosTheta2Sq = 1.0 - sinTheta2Sq;
		if ( cosTheta2Sq < 0.0 ) {
			return vec3( 1.0 );
		}
		float cosTheta2 = sqrt( cosTheta2Sq );
		float R0 = IorToFresnel0( iridescenceIOR, outsideIOR );
		float R12 = F_Schlick( R0, 1.0, cosTheta1 );
		float T121 = 1.0 - R12;
		float phi12 = 0.0;
		if ( iridescenceIOR < outsideIOR ) phi12 = PI;
		float phi21 = PI - phi12;
		vec3 baseIOR = Fresnel0ToIor( clamp( baseF0, 0.0, 0.9999 ) );		vec3 R1 = IorToFresnel0( baseIOR, iridescenceIOR );
		vec3 R23 = F_Schlick( R1, 1.0, cosTheta2 );
		vec3 phi23 = vec3( 0.0 );
		if ( baseIOR[ 0 ] < iridescenceIOR ) phi23[ 0 ] = PI;
		if ( baseIOR[ 1 ] < iridescenceIOR ) phi23[ 1 ] = PI;
		if ( baseIOR[ 2 ] < iridescenceIOR ) phi23[ 2 ] = PI;
		float OPD = 2.0 * iridescenceIOR * thinFilmThickness * cosTheta2;
		vec3 phi = vec3( phi21 ) + phi23;
		vec3 R123 = clamp( R12 * R23, 1e-5, 0.9999 );
		vec3 r123 = sqrt( R123 );
		vec3 Rs = pow2( T121 ) * R23 / ( vec3( 1.0 ) - R123 );
		vec3 C0 = R12 + Rs;
		I = C0;
		vec3 Cm = Rs - T121;
		for ( int m = 1; m <= 2; ++ m ) {
			Cm *= r123;
			vec3 Sm = 2.0 * evalSensitivity( float( m ) * OPD, float( m ) * phi );
			I += Cm * Sm;
		}
		return max( I, vec3( 0.0 ) );
	}
#endif`,_y=`#ifdef USE_BUMPMAP
	uniform sampler2D bumpMap;
	uniform float bumpScale;
	vec2 dHdxy_fwd() {
		vec2 dSTdx = dFdx( vBumpMapUv );
		vec2 dSTdy = dFdy( vBumpMapUv );
		float Hll = bumpScale * texture2D( bumpMap, vBumpMapUv ).x;
		float dBx = bumpScale * texture2D( bumpMap, vBumpMapUv + dSTdx ).x - Hll;
		float dBy = bumpScale * texture2D( bumpMap, vBumpMapUv + dSTdy ).x - Hll;
		return vec2( dBx, dBy );
	}
	vec3 perturbNormalArb( vec3 surf_pos, vec3 surf_norm, vec2 dHdxy, float faceDirection ) {
		vec3 vSigmaX = normalize( dFdx( surf_pos.xyz ) );
		vec3 vSigmaY = normalize( dFdy( surf_pos.xyz ) );
		vec3 vN = surf_norm;
		vec3 R1 = cross( vSigmaY, vN );
		vec3 R2 = cross( vN, vSigmaX );
		float fDet = dot( vSigmaX, R1 ) * faceDirection;
		vec3 vGrad = sign( fDet ) * ( dHdxy.x * R1 + dHdxy.y * R2 );
		return normalize( abs( fDet ) * surf_norm - vGrad );
	}
#endif`,xy=`#if NUM_CLIPPING_PLANES > 0
	vec4 plane;
	#ifdef ALPHA_TO_COVERAGE
		float distanceToPlane, distanceGradient;
		float clipOpacity = 1.0;
		#pragma unroll_loop_start
		for ( int i = 0; i < UNION_CLIPPING_PLANES; i ++ ) {
			plane = clippingPlanes[ i ];
			distanceToPlane = - dot( vClipPosition, plane.xyz ) + plane.w;
			distanceGradient = fwidth( distanceToPlane ) / 2.0;
			clipOpacity *= smoothstep( - distanceGradient, distanceGradient, distanceToPlane );
			if ( clipOpacity == 0.0 ) discard;
		}
		#pragma unroll_loop_end
		#if UNION_CLIPPING_PLANES < NUM_CLIPPING_PLANES
			float unionClipOpacity = 1.0;
			#pragma unroll_loop_start
			for ( int i = UNION_CLIPPING_PLANES; i < NUM_CLIPPING_PLANES; i ++ ) {
				plane = clippingPlanes[ i ];
				distanceToPlane = - dot( vClipPosition, plane.xyz ) + plane.w;
				distanceGradient = fwidth( distanceToPlane ) / 2.0;
				unionClipOpacity *= 1.0 - smoothstep( - distanceGradient, distanceGradient, distanceToPlane );
			}
			#pragma unroll_loop_end
			clipOpacity *= 1.0 - unionClipOpacity;
		#endif
		diffuseColor.a *= clipOpacity;
		if ( diffuseColor.a == 0.0 ) discard;
	#else
		#pragma unroll_loop_start
		for ( int i = 0; i < UNION_CLIPPING_PLANES; i ++ ) {
			plane = clippingPlanes[ i ];
			if ( dot( vClipPosition, plane.xyz ) > plane.w ) discard;
		}
		#pragma unroll_loop_end
		#if UNION_CLIPPING_PLANES < NUM_CLIPPING_PLANES
			bool clipped = true;
			#pragma unroll_loop_start
			for ( int i = UNION_CLIPPING_PLANES; i < NUM_CLIPPING_PLANES; i ++ ) {
				plane = clippingPlanes[ i ];
				clipped = ( dot( vClipPosition, plane.xyz ) > plane.w ) && clipped;
			}
			#pragma unroll_loop_end
			if ( clipped ) discard;
		#endif
	#endif
#endif`,yy=`#if NUM_CLIPPING_PLANES > 0
	varying vec3 vClipPosition;
	uniform vec4 clippingPlanes[ NUM_CLIPPING_PLANES ];
#endif`,vy=`#if NUM_CLIPPING_PLANES > 0
	varying vec3 vClipPosition;
#endif`,Sy=`#if NUM_CLIPPING_PLANES > 0
	vClipPosition = - mvPosition.xyz;
#endif`,by=`#if defined( USE_COLOR ) || defined( USE_COLOR_ALPHA )
	diffuseColor *= vColor;
#endif`,My=`#if defined( USE_COLOR ) || defined( USE_COLOR_ALPHA )
	varying vec4 vColor;
#endif`,wy=`#if defined( USE_COLOR ) || defined( USE_COLOR_ALPHA ) || defined( USE_INSTANCING_COLOR ) || defined( USE_BATCHING_COLOR )
	varying vec4 vColor;
#endif`,Ty=`#if defined( USE_COLOR ) || defined( USE_COLOR_ALPHA ) || defined( USE_INSTANCING_COLOR ) || defined( USE_BATCHING_COLOR )
	vColor = vec4( 1.0 );
#endif
#ifdef USE_COLOR_ALPHA
	vColor *= color;
#elif defined( USE_COLOR )
	vColor.rgb *= color;
#endif
#ifdef USE_INSTANCING_COLOR
	vColor.rgb *= instanceColor.rgb;
#endif
#ifdef USE_BATCHING_COLOR
	vColor *= getBatchingColor( getIndirectIndex( gl_DrawID ) );
#endif`,Ay=`#define PI 3.141592653589793
#define PI2 6.283185307179586
#define PI_HALF 1.5707963267948966
#define RECIPROCAL_PI 0.3183098861837907
#define RECIPROCAL_PI2 0.15915494309189535
#define EPSILON 1e-6
#ifndef saturate
#define saturate( a ) clamp( a, 0.0, 1.0 )
#endif
#define whiteComplement( a ) ( 1.0 - saturate( a ) )
float pow2( const in float x ) { return x*x; }
vec3 pow2( const in vec3 x ) { return x*x; }
float pow3( const in float x ) { return x*x*x; }
float pow4( const in float x ) { float x2 = x*x; return x2*x2; }
float max3( const in vec3 v ) { return max( max( v.x, v.y ), v.z ); }
float average( const in vec3 v ) { return dot( v, vec3( 0.3333333 ) ); }
highp float rand( const in vec2 uv ) {
	const highp float a = 12.9898, b = 78.233, c = 43758.5453;
	highp float dt = dot( uv.xy, vec2( a,b ) ), sn = mod( dt, PI );
	return fract( sin( sn ) * c );
}
#ifdef HIGH_PRECISION
	float precisionSafeLength( vec3 v ) { return length( v ); }
#else
	float precisionSafeLength( vec3 v ) {
		float maxComponent = max3( abs( v ) );
		return length( v / maxComponent ) * maxComponent;
	}
#endif
struct IncidentLight {
	vec3 color;
	vec3 direction;
	bool visible;
};
struct ReflectedLight {
	vec3 directDiffuse;
	vec3 directSpecular;
	vec3 indirectDiffuse;
	vec3 indirectSpecular;
};
#ifdef USE_ALPHAHASH
	varying vec3 vPosition;
#endif
vec3 transformDirection( in vec3 dir, in mat4 matrix ) {
	return normalize( ( matrix * vec4( dir, 0.0 ) ).xyz );
}
#define inverseTransformDirection transformDirectionByInverseViewMatrix
vec3 transformNormalByInverseViewMatrix( in vec3 normal, in mat4 viewMatrix ) {
	return normalize( ( vec4( normal, 0.0 ) * viewMatrix ).xyz );
}
vec3 transformDirectionByInverseViewMatrix( in vec3 dir, in mat4 viewMatrix ) {
	return normalize( ( vec4( dir, 0.0 ) * viewMatrix ).xyz );
}
bool isPerspectiveMatrix( mat4 m ) {
	return m[ 2 ][ 3 ] == - 1.0;
}
vec2 equirectUv( in vec3 dir ) {
	float u = atan( dir.z, dir.x ) * RECIPROCAL_PI2 + 0.5;
	float v = asin( clamp( dir.y, - 1.0, 1.0 ) ) * RECIPROCAL_PI + 0.5;
	return vec2( u, v );
}
vec3 BRDF_Lambert( const in vec3 diffuseColor ) {
	return RECIPROCAL_PI * diffuseColor;
}
vec3 F_Schlick( const in vec3 f0, const in float f90, const in float dotVH ) {
	float fresnel = exp2( ( - 5.55473 * dotVH - 6.98316 ) * dotVH );
	return f0 * ( 1.0 - fresnel ) + ( f90 * fresnel );
}
float F_Schlick( const in float f0, const in float f90, const in float dotVH ) {
	float fresnel = exp2( ( - 5.55473 * dotVH - 6.98316 ) * dotVH );
	return f0 * ( 1.0 - fresnel ) + ( f90 * fresnel );
} // validated`,Ey=`vec3 transformedNormal = objectNormal;
#ifdef USE_TANGENT
	vec3 transformedTangent = objectTangent;
#endif
#ifdef USE_BATCHING
	mat3 bm = mat3( batchingMatrix );
	transformedNormal /= vec3( dot( bm[ 0 ], bm[ 0 ] ), dot( bm[ 1 ], bm[ 1 ] ), dot( bm[ 2 ], bm[ 2 ] ) );
	transformedNormal = bm * transformedNormal;
	#ifdef USE_TANGENT
		transformedTangent = bm * transformedTangent;
	#endif
#endif
#ifdef USE_INSTANCING
	mat3 im = mat3( instanceMatrix );
	transformedNormal /= vec3( dot( im[ 0 ], im[ 0 ] ), dot( im[ 1 ], im[ 1 ] ), dot( im[ 2 ], im[ 2 ] ) );
	transformedNormal = im * transformedNormal;
	#ifdef USE_TANGENT
		transformedTangent = im * transformedTangent;
	#endif
#endif
transformedNormal = normalMatrix * transformedNormal;
#ifdef FLIP_SIDED
	transformedNormal = - transformedNormal;
#endif
#ifdef USE_TANGENT
	transformedTangent = ( modelViewMatrix * vec4( transformedTangent, 0.0 ) ).xyz;
#endif`,Cy=`#ifdef USE_DISPLACEMENTMAP
	uniform sampler2D displacementMap;
	uniform float displacementScale;
	uniform float displacementBias;
#endif`,Ry=`#ifdef USE_DISPLACEMENTMAP
	transformed += normalize( objectNormal ) * ( texture2D( displacementMap, vDisplacementMapUv ).x * displacementScale + displacementBias );
#endif`,Iy=`#ifdef USE_EMISSIVEMAP
	vec4 emissiveColor = texture2D( emissiveMap, vEmissiveMapUv );
	#ifdef DECODE_VIDEO_TEXTURE_EMISSIVE
		emissiveColor = sRGBTransferEOTF( emissiveColor );
	#endif
	totalEmissiveRadiance *= emissiveColor.rgb;
#endif`,Py=`#ifdef USE_EMISSIVEMAP
	uniform sampler2D emissiveMap;
#endif`,Ly="gl_FragColor = linearToOutputTexel( gl_FragColor );",Dy=`vec4 LinearTransferOETF( in vec4 value ) {
	return value;
}
vec4 sRGBTransferEOTF( in vec4 value ) {
	return vec4( mix( pow( value.rgb * 0.9478672986 + vec3( 0.0521327014 ), vec3( 2.4 ) ), value.rgb * 0.0773993808, vec3( lessThanEqual( value.rgb, vec3( 0.04045 ) ) ) ), value.a );
}
vec4 sRGBTransferOETF( in vec4 value ) {
	return vec4( mix( pow( value.rgb, vec3( 0.41666 ) ) * 1.055 - vec3( 0.055 ), value.rgb * 12.92, vec3( lessThanEqual( value.rgb, vec3( 0.0031308 ) ) ) ), value.a );
}`,Ny=`#ifdef USE_ENVMAP
	#ifdef ENV_WORLDPOS
		vec3 cameraToFrag;
		if ( isOrthographic ) {
			cameraToFrag = normalize( vec3( - viewMatrix[ 0 ][ 2 ], - viewMatrix[ 1 ][ 2 ], - viewMatrix[ 2 ][ 2 ] ) );
		} else {
			cameraToFrag = normalize( vWorldPosition - cameraPosition );
		}
		vec3 worldNormal = transformNormalByInverseViewMatrix( normal, viewMatrix );
		#ifdef ENVMAP_MODE_REFLECTION
			vec3 reflectVec = reflect( cameraToFrag, worldNormal );
		#else
			vec3 reflectVec = refract( cameraToFrag, worldNormal, refractionRatio );
		#endif
	#else
		vec3 reflectVec = vReflect;
	#endif
	#ifdef ENVMAP_TYPE_CUBE
		vec4 envColor = textureCube( envMap, envMapRotation * reflectVec );
		#ifdef ENVMAP_BLENDING_MULTIPLY
			outgoingLight = mix( outgoingLight, outgoingLight * envColor.xyz, specularStrength * reflectivity );
		#elif defined( ENVMAP_BLENDING_MIX )
			outgoingLight = mix( outgoingLight, envColor.xyz, specularStrength * reflectivity );
		#elif defined( ENVMAP_BLENDING_ADD )
			outgoingLight += envColor.xyz * specularStrength * reflectivity;
		#endif
	#endif
#endif`,Uy=`#ifdef USE_ENVMAP
	uniform float envMapIntensity;
	uniform mat3 envMapRotation;
	uniform samplerCube envMap;
	#ifdef ENVMAP_TYPE_PMREM
		float roughnessToMip( const in float roughness ) {
			float r = clamp( roughness, 0.0, 1.0 );
			return ENVMAP_MAX_LOD * r * ( 2.0 - r );
		}
	#endif
#endif`,Oy=`#ifdef USE_ENVMAP
	uniform float reflectivity;
	#if defined( USE_BUMPMAP ) || defined( USE_NORMALMAP ) || defined( PHONG ) || defined( LAMBERT )
		#define ENV_WORLDPOS
	#endif
	#ifdef ENV_WORLDPOS
		varying vec3 vWorldPosition;
		uniform float refractionRatio;
	#else
		varying vec3 vReflect;
	#endif
#endif`,Fy=`#ifdef USE_ENVMAP
	#if defined( USE_BUMPMAP ) || defined( USE_NORMALMAP ) || defined( PHONG ) || defined( LAMBERT )
		#define ENV_WORLDPOS
	#endif
	#ifdef ENV_WORLDPOS
		
		varying vec3 vWorldPosition;
	#else
		varying vec3 vReflect;
		uniform float refractionRatio;
	#endif
#endif`,By=`#ifdef USE_ENVMAP
	#ifdef ENV_WORLDPOS
		vWorldPosition = worldPosition.xyz;
	#else
		vec3 cameraToVertex;
		if ( isOrthographic ) {
			cameraToVertex = normalize( vec3( - viewMatrix[ 0 ][ 2 ], - viewMatrix[ 1 ][ 2 ], - viewMatrix[ 2 ][ 2 ] ) );
		} else {
			cameraToVertex = normalize( worldPosition.xyz - cameraPosition );
		}
		vec3 worldNormal = transformNormalByInverseViewMatrix( transformedNormal, viewMatrix );
		#ifdef ENVMAP_MODE_REFLECTION
			vReflect = reflect( cameraToVertex, worldNormal );
		#else
			vReflect = refract( cameraToVertex, worldNormal, refractionRatio );
		#endif
	#endif
#endif`,ky=`#ifdef USE_FOG
	vFogDepth = - mvPosition.z;
#endif`,zy=`#ifdef USE_FOG
	varying float vFogDepth;
#endif`,Vy=`#ifdef USE_FOG
	#ifdef FOG_EXP2
		float fogFactor = 1.0 - exp( - fogDensity * fogDensity * vFogDepth * vFogDepth );
	#else
		float fogFactor = smoothstep( fogNear, fogFar, vFogDepth );
	#endif
	gl_FragColor.rgb = mix( gl_FragColor.rgb, fogColor, fogFactor );
#endif`,Gy=`#ifdef USE_FOG
	uniform vec3 fogColor;
	varying float vFogDepth;
	#ifdef FOG_EXP2
		uniform float fogDensity;
	#else
		uniform float fogNear;
		uniform float fogFar;
	#endif
#endif`,Hy=`#ifdef USE_GRADIENTMAP
	uniform sampler2D gradientMap;
#endif
vec3 getGradientIrradiance( vec3 normal, vec3 lightDirection ) {
	float dotNL = dot( normal, lightDirection );
	vec2 coord = vec2( dotNL * 0.5 + 0.5, 0.0 );
	#ifdef USE_GRADIENTMAP
		return vec3( texture2D( gradientMap, coord ).r );
	#else
		vec2 fw = fwidth( coord ) * 0.5;
		return mix( vec3( 0.7 ), vec3( 1.0 ), smoothstep( 0.7 - fw.x, 0.7 + fw.x, coord.x ) );
	#endif
}`,Wy=`#ifdef USE_LIGHTMAP
	uniform sampler2D lightMap;
	uniform float lightMapIntensity;
#endif`,Xy=`LambertMaterial material;
material.diffuseColor = diffuseColor.rgb;
material.specularStrength = specularStrength;`,qy=`varying vec3 vViewPosition;
struct LambertMaterial {
	vec3 diffuseColor;
	float specularStrength;
};
void RE_Direct_Lambert( const in IncidentLight directLight, const in vec3 geometryPosition, const in vec3 geometryNormal, const in vec3 geometryViewDir, const in vec3 geometryClearcoatNormal, const in LambertMaterial material, inout ReflectedLight reflectedLight ) {
	float dotNL = saturate( dot( geometryNormal, directLight.direction ) );
	vec3 irradiance = dotNL * directLight.color;
	reflectedLight.directDiffuse += irradiance * BRDF_Lambert( material.diffuseColor );
}
void RE_IndirectDiffuse_Lambert( const in vec3 irradiance, const in vec3 geometryPosition, const in vec3 geometryNormal, const in vec3 geometryViewDir, const in vec3 geometryClearcoatNormal, const in LambertMaterial material, inout ReflectedLight reflectedLight ) {
	reflectedLight.indirectDiffuse += irradiance * BRDF_Lambert( material.diffuseColor );
}
#define RE_Direct				RE_Direct_Lambert
#define RE_IndirectDiffuse		RE_IndirectDiffuse_Lambert`,Yy=`uniform bool receiveShadow;
uniform vec3 ambientLightColor;
#if defined( USE_LIGHT_PROBES )
	uniform vec3 lightProbe[ 9 ];
#endif
vec3 shGetIrradianceAt( in vec3 normal, in vec3 shCoefficients[ 9 ] ) {
	float x = normal.x, y = normal.y, z = normal.z;
	vec3 result = shCoefficients[ 0 ] * 0.886227;
	result += shCoefficients[ 1 ] * 2.0 * 0.511664 * y;
	result += shCoefficients[ 2 ] * 2.0 * 0.511664 * z;
	result += shCoefficients[ 3 ] * 2.0 * 0.511664 * x;
	result += shCoefficients[ 4 ] * 2.0 * 0.429043 * x * y;
	result += shCoefficients[ 5 ] * 2.0 * 0.429043 * y * z;
	result += shCoefficients[ 6 ] * ( 0.743125 * z * z - 0.247708 );
	result += shCoefficients[ 7 ] * 2.0 * 0.429043 * x * z;
	result += shCoefficients[ 8 ] * 0.429043 * ( x * x - y * y );
	return result;
}
vec3 getLightProbeIrradiance( const in vec3 lightProbe[ 9 ], const in vec3 normal ) {
	vec3 worldNormal = transformNormalByInverseViewMatrix( normal, viewMatrix );
	vec3 irradiance = shGetIrradianceAt( worldNormal, lightProbe );
	return irradiance;
}
vec3 getAmbientLightIrradiance( const in vec3 ambientLightColor ) {
	vec3 irradiance = ambientLightColor;
	return irradiance;
}
float getDistanceAttenuation( const in float lightDistance, const in float cutoffDistance, const in float decayExponent ) {
	float distanceFalloff = 1.0 / max( pow( lightDistance, decayExponent ), 0.01 );
	if ( cutoffDistance > 0.0 ) {
		distanceFalloff *= pow2( saturate( 1.0 - pow4( lightDistance / cutoffDistance ) ) );
	}
	return distanceFalloff;
}
float getSpotAttenuation( const in float coneCosine, const in float penumbraCosine, const in float angleCosine ) {
	return smoothstep( coneCosine, penumbraCosine, angleCosine );
}
#if NUM_SUN_LIGHTS > 0
	struct SunLight {
		vec3 direction;
		vec3 color;
	};
	uniform SunLight sunLights[ NUM_SUN_LIGHTS ];
	void getSunLightInfo( const in SunLight sunLight, out IncidentLight light ) {
		light.color = sunLight.color;
		light.direction = sunLight.direction;
		light.visible = true;
	}
#endif
#if NUM_DIR_LIGHTS > 0
	struct DirectionalLight {
		vec3 direction;
		vec3 color;
	};
	uniform DirectionalLight directionalLights[ NUM_DIR_LIGHTS ];
	void getDirectionalLightInfo( const in DirectionalLight directionalLight, out IncidentLight light ) {
		light.color = directionalLight.color;
		light.direction = directionalLight.direction;
		light.visible = true;
	}
#endif
#if NUM_POINT_LIGHTS > 0
	struct PointLight {
		vec3 position;
		vec3 color;
		float distance;
		float decay;
	};
	uniform PointLight pointLights[ NUM_POINT_LIGHTS ];
	void getPointLightInfo( const in PointLight pointLight, const in vec3 geometryPosition, out IncidentLight light ) {
		vec3 lVector = pointLight.position - geometryPosition;
		light.direction = normalize( lVector );
		float lightDistance = length( lVector );
		light.color = pointLight.color;
		light.color *= getDistanceAttenuation( lightDistance, pointLight.distance, pointLight.decay );
		light.visible = ( light.color != vec3( 0.0 ) );
	}
#endif
#if NUM_SPOT_LIGHTS > 0
	struct SpotLight {
		vec3 position;
		vec3 direction;
		vec3 color;
		float distance;
		float decay;
		float coneCos;
		float penumbraCos;
	};
	uniform SpotLight spotLights[ NUM_SPOT_LIGHTS ];
	void getSpotLightInfo( const in SpotLight spotLight, const in vec3 geometryPosition, out IncidentLight light ) {
		vec3 lVector = spotLight.position - geometryPosition;
		light.direction = normalize( lVector );
		float angleCos = dot( light.direction, spotLight.direction );
		float spotAttenuation = getSpotAttenuation( spotLight.coneCos, spotLight.penumbraCos, angleCos );
		if ( spotAttenuation > 0.0 ) {
			float lightDistance = length( lVector );
			light.color = spotLight.color * spotAttenuation;
			light.color *= getDistanceAttenuation( lightDistance, spotLight.distance, spotLight.decay );
			light.visible = ( light.color != vec3( 0.0 ) );
		} else {
			light.color = vec3( 0.0 );
			light.visible = false;
		}
	}
#endif
#if NUM_RECT_AREA_LIGHTS > 0
	struct RectAreaLight {
		vec3 color;
		vec3 position;
		vec3 halfWidth;
		vec3 halfHeight;
	};
	uniform sampler2D ltc_1;	uniform sampler2D ltc_2;
	uniform RectAreaLight rectAreaLights[ NUM_RECT_AREA_LIGHTS ];
#endif
#if NUM_HEMI_LIGHTS > 0
	struct HemisphereLight {
		vec3 direction;
		vec3 skyColor;
		vec3 groundColor;
	};
	uniform HemisphereLight hemisphereLights[ NUM_HEMI_LIGHTS ];
	vec3 getHemisphereLightIrradiance( const in HemisphereLight hemiLight, const in vec3 normal ) {
		float dotNL = dot( normal, hemiLight.direction );
		float hemiDiffuseWeight = 0.5 * dotNL + 0.5;
		vec3 irradiance = mix( hemiLight.groundColor, hemiLight.skyColor, hemiDiffuseWeight );
		return irradiance;
	}
#endif
#include <lightprobes_pars_fragment>`,$y=`#ifdef USE_ENVMAP
	vec3 getIBLIrradiance( const in vec3 normal ) {
		#ifdef ENVMAP_TYPE_PMREM
			vec3 worldNormal = transformNormalByInverseViewMatrix( normal, viewMatrix );
			vec4 envMapColor = textureLod( envMap, envMapRotation * worldNormal, ENVMAP_MAX_LOD );
			return PI * envMapColor.rgb * envMapIntensity;
		#else
			return vec3( 0.0 );
		#endif
	}
	vec3 getIBLRadiance( const in vec3 viewDir, const in vec3 normal, const in float roughness ) {
		#ifdef ENVMAP_TYPE_PMREM
			vec3 reflectVec = reflect( - viewDir, normal );
			reflectVec = normalize( mix( reflectVec, normal, pow4( roughness ) ) );
			reflectVec = transformDirectionByInverseViewMatrix( reflectVec, viewMatrix );
			vec4 envMapColor = textureLod( envMap, envMapRotation * reflectVec, roughnessToMip( roughness ) );
			return envMapColor.rgb * envMapIntensity;
		#else
			return vec3( 0.0 );
		#endif
	}
	#ifdef USE_RETROREFLECTION
		vec3 getIBLRetroRadiance( const in vec3 viewDir, const in vec3 normal, const in float roughness ) {
			#ifdef ENVMAP_TYPE_PMREM
				vec3 retroVec = normalize( mix( viewDir, normal, pow4( roughness ) ) );
				retroVec = transformDirectionByInverseViewMatrix( retroVec, viewMatrix );
				vec4 envMapColor = textureLod( envMap, envMapRotation * retroVec, roughnessToMip( roughness ) );
				return envMapColor.rgb * envMapIntensity;
			#else
				return vec3( 0.0 );
			#endif
		}
	#endif
	#ifdef USE_ANISOTROPY
		vec3 getIBLAnisotropyRadiance( const in vec3 viewDir, const in vec3 normal, const in float roughness, const in vec3 bitangent, const in float anisotropy ) {
			#ifdef ENVMAP_TYPE_PMREM
				vec3 bentNormal = cross( bitangent, viewDir );
				bentNormal = normalize( cross( bentNormal, bitangent ) );
				bentNormal = normalize( mix( bentNormal, normal, pow2( pow2( 1.0 - anisotropy * ( 1.0 - roughness ) ) ) ) );
				return getIBLRadiance( viewDir, bentNormal, roughness );
			#else
				return vec3( 0.0 );
			#endif
		}
		#ifdef USE_RETROREFLECTION
			vec3 getIBLAnisotropyRetroRadiance( const in vec3 viewDir, const in vec3 normal, const in float roughness, const in vec3 bitangent, const in float anisotropy ) {
				#ifdef ENVMAP_TYPE_PMREM
					vec3 bentNormal = cross( bitangent, viewDir );
					bentNormal = normalize( cross( bentNormal, bitangent ) );
					bentNormal = normalize( mix( bentNormal, normal, pow2( pow2( 1.0 - anisotropy * ( 1.0 - roughness ) ) ) ) );
					return getIBLRetroRadiance( viewDir, bentNormal, roughness );
				#else
					return vec3( 0.0 );
				#endif
			}
		#endif
	#endif
#endif`,Ky=`ToonMaterial material;
material.diffuseColor = diffuseColor.rgb;`,Zy=`varying vec3 vViewPosition;
struct ToonMaterial {
	vec3 diffuseColor;
};
void RE_Direct_Toon( const in IncidentLight directLight, const in vec3 geometryPosition, const in vec3 geometryNormal, const in vec3 geometryViewDir, const in vec3 geometryClearcoatNormal, const in ToonMaterial material, inout ReflectedLight reflectedLight ) {
	vec3 irradiance = getGradientIrradiance( geometryNormal, directLight.direction ) * directLight.color;
	reflectedLight.directDiffuse += irradiance * BRDF_Lambert( material.diffuseColor );
}
void RE_IndirectDiffuse_Toon( const in vec3 irradiance, const in vec3 geometryPosition, const in vec3 geometryNormal, const in vec3 geometryViewDir, const in vec3 geometryClearcoatNormal, const in ToonMaterial material, inout ReflectedLight reflectedLight ) {
	reflectedLight.indirectDiffuse += irradiance * BRDF_Lambert( material.diffuseColor );
}
#define RE_Direct				RE_Direct_Toon
#define RE_IndirectDiffuse		RE_IndirectDiffuse_Toon`,Jy=`BlinnPhongMaterial material;
material.diffuseColor = diffuseColor.rgb;
material.specularColor = specular;
material.specularShininess = shininess;
material.specularStrength = specularStrength;`,jy=`varying vec3 vViewPosition;
struct BlinnPhongMaterial {
	vec3 diffuseColor;
	vec3 specularColor;
	float specularShininess;
	float specularStrength;
};
void RE_Direct_BlinnPhong( const in IncidentLight directLight, const in vec3 geometryPosition, const in vec3 geometryNormal, const in vec3 geometryViewDir, const in vec3 geometryClearcoatNormal, const in BlinnPhongMaterial material, inout ReflectedLight reflectedLight ) {
	float dotNL = saturate( dot( geometryNormal, directLight.direction ) );
	vec3 irradiance = dotNL * directLight.color;
	reflectedLight.directDiffuse += irradiance * BRDF_Lambert( material.diffuseColor );
	reflectedLight.directSpecular += irradiance * BRDF_BlinnPhong( directLight.direction, geometryViewDir, geometryNormal, material.specularColor, material.specularShininess ) * material.specularStrength;
}
void RE_IndirectDiffuse_BlinnPhong( const in vec3 irradiance, const in vec3 geometryPosition, const in vec3 geometryNormal, const in vec3 geometryViewDir, const in vec3 geometryClearcoatNormal, const in BlinnPhongMaterial material, inout ReflectedLight reflectedLight ) {
	reflectedLight.indirectDiffuse += irradiance * BRDF_Lambert( material.diffuseColor );
}
#define RE_Direct				RE_Direct_BlinnPhong
#define RE_IndirectDiffuse		RE_IndirectDiffuse_BlinnPhong`,Qy=`PhysicalMaterial material;
material.diffuseColor = diffuseColor.rgb;
material.diffuseContribution = diffuseColor.rgb * ( 1.0 - metalnessFactor );
material.metalness = metalnessFactor;
vec3 dxy = max( abs( dFdx( nonPerturbedNormal ) ), abs( dFdy( nonPerturbedNormal ) ) );
float geometryRoughness = max( max( dxy.x, dxy.y ), dxy.z );
material.roughness = max( roughnessFactor, 0.045 );
material.roughness += geometryRoughness;
material.roughness = min( material.roughness, 1.0 );
#ifdef USE_DIFFUSE_ROUGHNESS
	float diffuseRoughnessFactor = diffuseRoughness;
	#ifdef USE_DIFFUSE_ROUGHNESSMAP
		diffuseRoughnessFactor *= texture2D( diffuseRoughnessMap, vDiffuseRoughnessMapUv ).r;
	#endif
	material.diffuseRoughness = saturate( diffuseRoughnessFactor );
#endif
#ifdef IOR
	material.ior = ior;
	#ifdef USE_SPECULAR
		float specularIntensityFactor = specularIntensity;
		vec3 specularColorFactor = specularColor;
		#ifdef USE_SPECULAR_COLORMAP
			specularColorFactor *= texture2D( specularColorMap, vSpecularColorMapUv ).rgb;
		#endif
		#ifdef USE_SPECULAR_INTENSITYMAP
			specularIntensityFactor *= texture2D( specularIntensityMap, vSpecularIntensityMapUv ).a;
		#endif
		material.specularF90 = mix( specularIntensityFactor, 1.0, metalnessFactor );
	#else
		float specularIntensityFactor = 1.0;
		vec3 specularColorFactor = vec3( 1.0 );
		material.specularF90 = 1.0;
	#endif
	material.specularColor = min( pow2( ( material.ior - 1.0 ) / ( material.ior + 1.0 ) ) * specularColorFactor, vec3( 1.0 ) ) * specularIntensityFactor;
	material.specularColorBlended = mix( material.specularColor, diffuseColor.rgb, metalnessFactor );
#else
	material.specularColor = vec3( 0.04 );
	material.specularColorBlended = mix( material.specularColor, diffuseColor.rgb, metalnessFactor );
	material.specularF90 = 1.0;
#endif
#ifdef USE_CLEARCOAT
	material.clearcoat = clearcoat;
	material.clearcoatRoughness = clearcoatRoughness;
	material.clearcoatF0 = vec3( 0.04 );
	material.clearcoatF90 = 1.0;
	#ifdef USE_CLEARCOATMAP
		material.clearcoat *= texture2D( clearcoatMap, vClearcoatMapUv ).x;
	#endif
	#ifdef USE_CLEARCOAT_ROUGHNESSMAP
		material.clearcoatRoughness *= texture2D( clearcoatRoughnessMap, vClearcoatRoughnessMapUv ).y;
	#endif
	material.clearcoat = saturate( material.clearcoat );	material.clearcoatRoughness = max( material.clearcoatRoughness, 0.045 );
	material.clearcoatRoughness += geometryRoughness;
	material.clearcoatRoughness = min( material.clearcoatRoughness, 1.0 );
#endif
#ifdef USE_DISPERSION
	material.dispersion = dispersion;
#endif
#ifdef USE_RETROREFLECTION
	material.retroreflectivity = retroreflectivity;
#endif
#ifdef USE_IRIDESCENCE
	material.iridescence = iridescence;
	material.iridescenceIOR = iridescenceIOR;
	#ifdef USE_IRIDESCENCEMAP
		material.iridescence *= texture2D( iridescenceMap, vIridescenceMapUv ).r;
	#endif
	#ifdef USE_IRIDESCENCE_THICKNESSMAP
		material.iridescenceThickness = (iridescenceThicknessMaximum - iridescenceThicknessMinimum) * texture2D( iridescenceThicknessMap, vIridescenceThicknessMapUv ).g + iridescenceThicknessMinimum;
	#else
		material.iridescenceThickness = iridescenceThicknessMaximum;
	#endif
#endif
#ifdef USE_SHEEN
	material.sheenColor = sheenColor;
	#ifdef USE_SHEEN_COLORMAP
		material.sheenColor *= texture2D( sheenColorMap, vSheenColorMapUv ).rgb;
	#endif
	material.sheenRoughness = clamp( sheenRoughness, 0.0001, 1.0 );
	#ifdef USE_SHEEN_ROUGHNESSMAP
		material.sheenRoughness *= texture2D( sheenRoughnessMap, vSheenRoughnessMapUv ).a;
	#endif
#endif
#ifdef USE_ANISOTROPY
	#ifdef USE_ANISOTROPYMAP
		mat2 anisotropyMat = mat2( anisotropyVector.x, anisotropyVector.y, - anisotropyVector.y, anisotropyVector.x );
		vec3 anisotropyPolar = texture2D( anisotropyMap, vAnisotropyMapUv ).rgb;
		vec2 anisotropyV = anisotropyMat * normalize( 2.0 * anisotropyPolar.rg - vec2( 1.0 ) ) * anisotropyPolar.b;
	#else
		vec2 anisotropyV = anisotropyVector;
	#endif
	material.anisotropy = length( anisotropyV );
	if( material.anisotropy == 0.0 ) {
		anisotropyV = vec2( 1.0, 0.0 );
	} else {
		anisotropyV /= material.anisotropy;
		material.anisotropy = saturate( material.anisotropy );
	}
	material.alphaT = mix( pow2( material.roughness ), 1.0, pow2( material.anisotropy ) );
	material.anisotropyT = tbn[ 0 ] * anisotropyV.x + tbn[ 1 ] * anisotropyV.y;
	material.anisotropyB = tbn[ 1 ] * anisotropyV.x - tbn[ 0 ] * anisotropyV.y;
#endif`,tv=`uniform sampler2D dfgLUT;
struct PhysicalMaterial {
	vec3 diffuseColor;
	vec3 diffuseContribution;
	vec3 specularColor;
	vec3 specularColorBlended;
	float roughness;
	float metalness;
	float specularF90;
	float dispersion;
	vec2 dfg;
	vec3 multiScatteringCompensation;
	#ifdef USE_DIFFUSE_ROUGHNESS
		float diffuseRoughness;
	#endif
	#ifdef USE_RETROREFLECTION
		float retroreflectivity;
	#endif
	#ifdef USE_CLEARCOAT
		float clearcoat;
		float clearcoatRoughness;
		vec3 clearcoatF0;
		float clearcoatF90;
	#endif
	#ifdef USE_IRIDESCENCE
		float iridescence;
		float iridescenceIOR;
		float iridescenceThickness;
		vec3 iridescenceFresnel;
		vec3 iridescenceF0Dielectric;
		vec3 iridescenceF0Metallic;
	#endif
	#ifdef USE_SHEEN
		vec3 sheenColor;
		float sheenRoughness;
	#endif
	#ifdef IOR
		float ior;
	#endif
	#ifdef USE_TRANSMISSION
		float transmission;
		float transmissionAlpha;
		float thickness;
		float attenuationDistance;
		vec3 attenuationColor;
	#endif
	#ifdef USE_ANISOTROPY
		float anisotropy;
		float alphaT;
		vec3 anisotropyT;
		vec3 anisotropyB;
	#endif
};
vec3 clearcoatSpecularDirect = vec3( 0.0 );
vec3 clearcoatSpecularIndirect = vec3( 0.0 );
vec3 sheenSpecularDirect = vec3( 0.0 );
vec3 sheenSpecularIndirect = vec3(0.0 );
vec3 Schlick_to_F0( const in vec3 f, const in float f90, const in float dotVH ) {
    float x = clamp( 1.0 - dotVH, 0.0, 1.0 );
    float x2 = x * x;
    float x5 = clamp( x * x2 * x2, 0.0, 0.9999 );
    return ( f - vec3( f90 ) * x5 ) / ( 1.0 - x5 );
}
#ifdef USE_DIFFUSE_ROUGHNESS
	const float EON_EPSILON = 1e-7;
	float FON_DirectionalAlbedo( const in float mu, const in float roughness, const in float A ) {
		float muComp = 1.0 - mu;
		float gOverPi = muComp * ( 0.0571085289 + muComp * ( 0.491881867 + muComp * ( - 0.332181442 + muComp * 0.0714429953 ) ) );
		return A * ( 1.0 + roughness * gOverPi );
	}
	vec3 BRDF_EON( const in vec3 lightDir, const in vec3 viewDir, const in vec3 normal, const in vec3 diffuseColor, const in float roughness ) {
		vec3 rho = saturate( diffuseColor );
		if ( roughness <= EON_EPSILON ) return BRDF_Lambert( rho );
		float dotNL = saturate( dot( normal, lightDir ) );
		float dotNV = saturate( dot( normal, viewDir ) );
		float s = dot( lightDir, viewDir ) - dotNL * dotNV;
		float sOverT = ( s > 0.0 ) ? s / max( max( dotNL, dotNV ), EON_EPSILON ) : s;
		float A = 1.0 / ( 1.0 + ( 0.5 - 2.0 / ( 3.0 * PI ) ) * roughness );
		vec3 singleScatter = rho * RECIPROCAL_PI * A * ( 1.0 + roughness * sOverT );
		float averageAlbedo = A * ( 1.0 + ( 2.0 / 3.0 - 28.0 / ( 15.0 * PI ) ) * roughness );
		float albedoV = FON_DirectionalAlbedo( dotNV, roughness, A );
		float albedoL = FON_DirectionalAlbedo( dotNL, roughness, A );
		vec3 rhoMultiScatter = rho * rho * averageAlbedo / max( vec3( EON_EPSILON ), vec3( 1.0 ) - rho * ( 1.0 - averageAlbedo ) );
		vec3 multiScatter = rhoMultiScatter * RECIPROCAL_PI
			* max( EON_EPSILON, 1.0 - albedoV )
			* max( EON_EPSILON, 1.0 - albedoL )
			/ max( EON_EPSILON, 1.0 - averageAlbedo );
		return singleScatter + multiScatter;
	}
	vec3 EON_DirectionalAlbedo( const in vec3 diffuseColor, const in float roughness, const in float dotNV ) {
		vec3 rho = saturate( diffuseColor );
		if ( roughness <= EON_EPSILON ) return rho;
		float A = 1.0 / ( 1.0 + ( 0.5 - 2.0 / ( 3.0 * PI ) ) * roughness );
		float directionalAlbedo = FON_DirectionalAlbedo( dotNV, roughness, A );
		float averageAlbedo = A * ( 1.0 + ( 2.0 / 3.0 - 28.0 / ( 15.0 * PI ) ) * roughness );
		vec3 rhoMultiScatter = rho * rho * averageAlbedo / max( vec3( EON_EPSILON ), vec3( 1.0 ) - rho * ( 1.0 - averageAlbedo ) );
		return rho * directionalAlbedo + rhoMultiScatter * ( 1.0 - directionalAlbedo );
	}
#endif
float V_GGX_SmithCorrelated( const in float alpha, const in float dotNL, const in float dotNV ) {
	float a2 = pow2( alpha );
	float gv = dotNL * sqrt( a2 + ( 1.0 - a2 ) * pow2( dotNV ) );
	float gl = dotNV * sqrt( a2 + ( 1.0 - a2 ) * pow2( dotNL ) );
	return 0.5 / max( gv + gl, EPSILON );
}
float D_GGX( const in float alpha, const in float dotNH ) {
	float a2 = pow2( alpha );
	float denom = pow2( dotNH ) * ( a2 - 1.0 ) + 1.0;
	return RECIPROCAL_PI * a2 / pow2( denom );
}
#ifdef USE_ANISOTROPY
	float V_GGX_SmithCorrelated_Anisotropic( const in float alphaT, const in float alphaB, const in float dotTV, const in float dotBV, const in float dotTL, const in float dotBL, const in float dotNV, const in float dotNL ) {
		float gv = dotNL * length( vec3( alphaT * dotTV, alphaB * dotBV, dotNV ) );
		float gl = dotNV * length( vec3( alphaT * dotTL, alphaB * dotBL, dotNL ) );
		return 0.5 / max( gv + gl, EPSILON );
	}
	float D_GGX_Anisotropic( const in float alphaT, const in float alphaB, const in float dotNH, const in float dotTH, const in float dotBH ) {
		float a2 = alphaT * alphaB;
		highp vec3 v = vec3( alphaB * dotTH, alphaT * dotBH, a2 * dotNH );
		highp float v2 = dot( v, v );
		float w2 = a2 / v2;
		return RECIPROCAL_PI * a2 * pow2 ( w2 );
	}
#endif
#ifdef USE_CLEARCOAT
	vec3 BRDF_GGX_Clearcoat( const in vec3 lightDir, const in vec3 viewDir, const in vec3 normal, const in PhysicalMaterial material) {
		vec3 f0 = material.clearcoatF0;
		float f90 = material.clearcoatF90;
		float roughness = max( material.clearcoatRoughness, 0.045 );
		float alpha = pow2( roughness );
		vec3 halfDir = normalize( lightDir + viewDir );
		float dotNL = saturate( dot( normal, lightDir ) );
		float dotNV = saturate( dot( normal, viewDir ) );
		float dotNH = saturate( dot( normal, halfDir ) );
		float dotVH = saturate( dot( viewDir, halfDir ) );
		vec3 F = F_Schlick( f0, f90, dotVH );
		float V = V_GGX_SmithCorrelated( alpha, dotNL, dotNV );
		float D = D_GGX( alpha, dotNH );
		return F * ( V * D );
	}
#endif
vec3 BRDF_GGX( const in vec3 lightDir, const in vec3 viewDir, const in vec3 normal, const in PhysicalMaterial material ) {
	vec3 f0 = material.specularColorBlended;
	float f90 = material.specularF90;
	float roughness = max( material.roughness, 0.045 );
	float alpha = pow2( roughness );
	vec3 halfDir = normalize( lightDir + viewDir );
	float dotNL = saturate( dot( normal, lightDir ) );
	float dotNV = saturate( dot( normal, viewDir ) );
	float dotNH = saturate( dot( normal, halfDir ) );
	float dotVH = saturate( dot( viewDir, halfDir ) );
	vec3 F = F_Schlick( f0, f90, dotVH );
	#ifdef USE_IRIDESCENCE
		F = mix( F, material.iridescenceFresnel, material.iridescence );
	#endif
	#ifdef USE_ANISOTROPY
		float dotTL = dot( material.anisotropyT, lightDir );
		float dotTV = dot( material.anisotropyT, viewDir );
		float dotTH = dot( material.anisotropyT, halfDir );
		float dotBL = dot( material.anisotropyB, lightDir );
		float dotBV = dot( material.anisotropyB, viewDir );
		float dotBH = dot( material.anisotropyB, halfDir );
		float alphaT = max( material.alphaT, alpha );
		float V = V_GGX_SmithCorrelated_Anisotropic( alphaT, alpha, dotTV, dotBV, dotTL, dotBL, dotNV, dotNL );
		float D = D_GGX_Anisotropic( alphaT, alpha, dotNH, dotTH, dotBH );
	#else
		float V = V_GGX_SmithCorrelated( alpha, dotNL, dotNV );
		float D = D_GGX( alpha, dotNH );
	#endif
	return F * ( V * D );
}
vec2 LTC_Uv( const in vec3 N, const in vec3 V, const in float roughness ) {
	const float LUT_SIZE = 64.0;
	const float LUT_SCALE = ( LUT_SIZE - 1.0 ) / LUT_SIZE;
	const float LUT_BIAS = 0.5 / LUT_SIZE;
	float dotNV = saturate( dot( N, V ) );
	vec2 uv = vec2( roughness, sqrt( 1.0 - dotNV ) );
	uv = uv * LUT_SCALE + LUT_BIAS;
	return uv;
}
float LTC_ClippedSphereFormFactor( const in vec3 f ) {
	float l = length( f );
	return max( ( l * l + f.z ) / ( l + 1.0 ), 0.0 );
}
vec3 LTC_EdgeVectorFormFactor( const in vec3 v1, const in vec3 v2 ) {
	float x = dot( v1, v2 );
	float y = abs( x );
	float a = 0.8543985 + ( 0.4965155 + 0.0145206 * y ) * y;
	float b = 3.4175940 + ( 4.1616724 + y ) * y;
	float v = a / b;
	float theta_sintheta = ( x > 0.0 ) ? v : 0.5 * inversesqrt( max( 1.0 - x * x, 1e-7 ) ) - v;
	return cross( v1, v2 ) * theta_sintheta;
}
vec3 LTC_Evaluate( const in vec3 N, const in vec3 V, const in vec3 P, const in mat3 mInv, const in vec3 rectCoords[ 4 ] ) {
	vec3 v1 = rectCoords[ 1 ] - rectCoords[ 0 ];
	vec3 v2 = rectCoords[ 3 ] - rectCoords[ 0 ];
	vec3 lightNormal = cross( v1, v2 );
	if( dot( lightNormal, P - rectCoords[ 0 ] ) < 0.0 ) return vec3( 0.0 );
	vec3 T1, T2;
	T1 = normalize( V - N * dot( V, N ) );
	T2 = - cross( N, T1 );
	mat3 mat = mInv * transpose( mat3( T1, T2, N ) );
	vec3 coords[ 4 ];
	coords[ 0 ] = mat * ( rectCoords[ 0 ] - P );
	coords[ 1 ] = mat * ( rectCoords[ 1 ] - P );
	coords[ 2 ] = mat * ( rectCoords[ 2 ] - P );
	coords[ 3 ] = mat * ( rectCoords[ 3 ] - P );
	coords[ 0 ] = normalize( coords[ 0 ] );
	coords[ 1 ] = normalize( coords[ 1 ] );
	coords[ 2 ] = normalize( coords[ 2 ] );
	coords[ 3 ] = normalize( coords[ 3 ] );
	vec3 vectorFormFactor = vec3( 0.0 );
	vectorFormFactor += LTC_EdgeVectorFormFactor( coords[ 0 ], coords[ 1 ] );
	vectorFormFactor += LTC_EdgeVectorFormFactor( coords[ 1 ], coords[ 2 ] );
	vectorFormFactor += LTC_EdgeVectorFormFactor( coords[ 2 ], coords[ 3 ] );
	vectorFormFactor += LTC_EdgeVectorFormFactor( coords[ 3 ], coords[ 0 ] );
	float result = LTC_ClippedSphereFormFactor( vectorFormFactor );
	return vec3( result );
}
#if defined( USE_SHEEN )
float D_Charlie( float roughness, float dotNH ) {
	float alpha = pow2( roughness );
	float invAlpha = 1.0 / alpha;
	float cos2h = dotNH * dotNH;
	float sin2h = max( 1.0 - cos2h, 0.0078125 );
	return ( 2.0 + invAlpha ) * pow( sin2h, invAlpha * 0.5 ) / ( 2.0 * PI );
}
float V_Neubelt( float dotNV, float dotNL ) {
	return saturate( 1.0 / ( 4.0 * ( dotNL + dotNV - dotNL * dotNV ) ) );
}
vec3 BRDF_Sheen( const in vec3 lightDir, const in vec3 viewDir, const in vec3 normal, vec3 sheenColor, const in float sheenRoughness ) {
	vec3 halfDir = normalize( lightDir + viewDir );
	float dotNL = saturate( dot( normal, lightDir ) );
	float dotNV = saturate( dot( normal, viewDir ) );
	float dotNH = saturate( dot( normal, halfDir ) );
	float D = D_Charlie( sheenRoughness, dotNH );
	float V = V_Neubelt( dotNV, dotNL );
	return sheenColor * ( D * V );
}
#endif
float IBLSheenBRDF( const in vec3 normal, const in vec3 viewDir, const in float roughness ) {
	float dotNV = saturate( dot( normal, viewDir ) );
	float r2 = roughness * roughness;
	float rInv = 1.0 / ( roughness + 0.1 );
	float a = -1.9362 + 1.0678 * roughness + 0.4573 * r2 - 0.8469 * rInv;
	float b = -0.6014 + 0.5538 * roughness - 0.4670 * r2 - 0.1255 * rInv;
	float DG = exp( a * dotNV + b );
	return saturate( DG );
}
vec3 EnvironmentBRDF( const in vec3 normal, const in vec3 viewDir, const in vec3 specularColor, const in float specularF90, const in float roughness ) {
	float dotNV = saturate( dot( normal, viewDir ) );
	vec2 fab = texture2D( dfgLUT, vec2( roughness, dotNV ) ).rg;
	return specularColor * fab.x + specularF90 * fab.y;
}
#ifdef USE_IRIDESCENCE
void computeMultiscatteringIridescence( const in vec2 fab, const in vec3 specularColor, const in float specularF90, const in float iridescence, const in vec3 iridescenceF0, inout vec3 singleScatter, inout vec3 multiScatter ) {
#else
void computeMultiscattering( const in vec2 fab, const in vec3 specularColor, const in float specularF90, inout vec3 singleScatter, inout vec3 multiScatter ) {
#endif
	#ifdef USE_IRIDESCENCE
		vec3 Fr = mix( specularColor, iridescenceF0, iridescence );
	#else
		vec3 Fr = specularColor;
	#endif
	vec3 FssEss = Fr * fab.x + specularF90 * fab.y;
	float Ess = fab.x + fab.y;
	float Ems = 1.0 - Ess;
	vec3 Favg = Fr + ( 1.0 - Fr ) * 0.047619;	vec3 Fms = FssEss * Favg / ( 1.0 - Ems * Favg );
	singleScatter += FssEss;
	multiScatter += Fms * Ems;
}
#if NUM_RECT_AREA_LIGHTS > 0
	void RE_Direct_RectArea_Physical( const in RectAreaLight rectAreaLight, const in vec3 geometryPosition, const in vec3 geometryNormal, const in vec3 geometryViewDir, const in vec3 geometryClearcoatNormal, const in PhysicalMaterial material, inout ReflectedLight reflectedLight ) {
		vec3 normal = geometryNormal;
		vec3 viewDir = geometryViewDir;
		vec3 position = geometryPosition;
		vec3 lightPos = rectAreaLight.position;
		vec3 halfWidth = rectAreaLight.halfWidth;
		vec3 halfHeight = rectAreaLight.halfHeight;
		vec3 lightColor = rectAreaLight.color;
		float roughness = material.roughness;
		vec3 rectCoords[ 4 ];
		rectCoords[ 0 ] = lightPos + halfWidth - halfHeight;		rectCoords[ 1 ] = lightPos - halfWidth - halfHeight;
		rectCoords[ 2 ] = lightPos - halfWidth + halfHeight;
		rectCoords[ 3 ] = lightPos + halfWidth + halfHeight;
		vec2 uv = LTC_Uv( normal, viewDir, roughness );
		vec4 t1 = texture2D( ltc_1, uv );
		vec4 t2 = texture2D( ltc_2, uv );
		mat3 mInv = mat3(
			vec3( t1.x, 0, t1.y ),
			vec3(    0, 1,    0 ),
			vec3( t1.z, 0, t1.w )
		);
		vec3 fresnel = ( material.specularColorBlended * t2.x + ( material.specularF90 - material.specularColorBlended ) * t2.y );
		reflectedLight.directSpecular += lightColor * fresnel * LTC_Evaluate( normal, viewDir, position, mInv, rectCoords );
		reflectedLight.directDiffuse += lightColor * material.diffuseContribution * LTC_Evaluate( normal, viewDir, position, mat3( 1.0 ), rectCoords );
		#ifdef USE_CLEARCOAT
			vec3 Ncc = geometryClearcoatNormal;
			vec2 uvClearcoat = LTC_Uv( Ncc, viewDir, material.clearcoatRoughness );
			vec4 t1Clearcoat = texture2D( ltc_1, uvClearcoat );
			vec4 t2Clearcoat = texture2D( ltc_2, uvClearcoat );
			mat3 mInvClearcoat = mat3(
				vec3( t1Clearcoat.x, 0, t1Clearcoat.y ),
				vec3(             0, 1,             0 ),
				vec3( t1Clearcoat.z, 0, t1Clearcoat.w )
			);
			vec3 fresnelClearcoat = material.clearcoatF0 * t2Clearcoat.x + ( material.clearcoatF90 - material.clearcoatF0 ) * t2Clearcoat.y;
			clearcoatSpecularDirect += lightColor * fresnelClearcoat * LTC_Evaluate( Ncc, viewDir, position, mInvClearcoat, rectCoords );
		#endif
	}
#endif
void RE_Direct_Physical( const in IncidentLight directLight, const in vec3 geometryPosition, const in vec3 geometryNormal, const in vec3 geometryViewDir, const in vec3 geometryClearcoatNormal, const in PhysicalMaterial material, inout ReflectedLight reflectedLight ) {
	float dotNL = saturate( dot( geometryNormal, directLight.direction ) );
	vec3 irradiance = dotNL * directLight.color;
	#ifdef USE_CLEARCOAT
		float dotNLcc = saturate( dot( geometryClearcoatNormal, directLight.direction ) );
		vec3 ccIrradiance = dotNLcc * directLight.color;
		clearcoatSpecularDirect += ccIrradiance * BRDF_GGX_Clearcoat( directLight.direction, geometryViewDir, geometryClearcoatNormal, material );
	#endif
	#ifdef USE_SHEEN
 
 		sheenSpecularDirect += irradiance * BRDF_Sheen( directLight.direction, geometryViewDir, geometryNormal, material.sheenColor, material.sheenRoughness );
 
 		float sheenAlbedoV = IBLSheenBRDF( geometryNormal, geometryViewDir, material.sheenRoughness );
 		float sheenAlbedoL = IBLSheenBRDF( geometryNormal, directLight.direction, material.sheenRoughness );
 
 		float sheenEnergyComp = 1.0 - max3( material.sheenColor ) * max( sheenAlbedoV, sheenAlbedoL );
 
 		irradiance *= sheenEnergyComp;
 
 	#endif
	vec3 specularBRDF = BRDF_GGX( directLight.direction, geometryViewDir, geometryNormal, material );
	#ifdef USE_RETROREFLECTION
		vec3 retroViewDir = reflect( - geometryViewDir, geometryNormal );
		vec3 retroSpecularBRDF = BRDF_GGX( directLight.direction, retroViewDir, geometryNormal, material );
		specularBRDF = mix( specularBRDF, retroSpecularBRDF, saturate( material.retroreflectivity ) );
	#endif
	reflectedLight.directSpecular += irradiance * specularBRDF * material.multiScatteringCompensation;
	vec3 halfDir = normalize( directLight.direction + geometryViewDir );
	float dotVH = saturate( dot( geometryViewDir, halfDir ) );
	vec3 F = F_Schlick( material.specularColor, material.specularF90, dotVH );
	#ifdef USE_RETROREFLECTION
		vec3 retroHalfDir = normalize( directLight.direction + retroViewDir );
		float dotRetroVH = saturate( dot( retroViewDir, retroHalfDir ) );
		vec3 retroF = F_Schlick( material.specularColor, material.specularF90, dotRetroVH );
		F = mix( F, retroF, saturate( material.retroreflectivity ) );
	#endif
	#ifdef USE_DIFFUSE_ROUGHNESS
		vec3 diffuseBRDF = BRDF_EON( directLight.direction, geometryViewDir, geometryNormal, material.diffuseColor, material.diffuseRoughness ) * ( 1.0 - material.metalness );
	#else
		vec3 diffuseBRDF = BRDF_Lambert( material.diffuseContribution );
	#endif
	reflectedLight.directDiffuse += irradiance * diffuseBRDF * ( 1.0 - F );
}
void RE_IndirectDiffuse_Physical( const in vec3 irradiance, const in vec3 geometryPosition, const in vec3 geometryNormal, const in vec3 geometryViewDir, const in vec3 geometryClearcoatNormal, const in PhysicalMaterial material, inout ReflectedLight reflectedLight ) {
	vec3 singleScattering = vec3( 0.0 );
	vec3 multiScattering = vec3( 0.0 );
	#ifdef USE_IRIDESCENCE
		computeMultiscatteringIridescence( material.dfg, material.specularColor, material.specularF90, material.iridescence, material.iridescenceF0Dielectric, singleScattering, multiScattering );
	#else
		computeMultiscattering( material.dfg, material.specularColor, material.specularF90, singleScattering, multiScattering );
	#endif
	#ifdef USE_DIFFUSE_ROUGHNESS
		float dotNV = saturate( dot( geometryNormal, geometryViewDir ) );
		vec3 diffuseAlbedo = EON_DirectionalAlbedo( material.diffuseColor, material.diffuseRoughness, dotNV ) * ( 1.0 - material.metalness );
		vec3 diffuse = irradiance * RECIPROCAL_PI * diffuseAlbedo * ( 1.0 - singleScattering - multiScattering );
	#else
		vec3 diffuse = irradiance * BRDF_Lambert( material.diffuseContribution ) * ( 1.0 - singleScattering - multiScattering );
	#endif
	#ifdef USE_SHEEN
		float sheenAlbedo = IBLSheenBRDF( geometryNormal, geometryViewDir, material.sheenRoughness );
		sheenSpecularIndirect += irradiance * material.sheenColor * sheenAlbedo * RECIPROCAL_PI;
		float sheenEnergyComp = 1.0 - max3( material.sheenColor ) * sheenAlbedo;
		diffuse *= sheenEnergyComp;
	#endif
	reflectedLight.indirectDiffuse += diffuse;
}
void RE_IndirectSpecular_Physical( const in vec3 radiance, const in vec3 irradiance, const in vec3 clearcoatRadiance, const in vec3 geometryPosition, const in vec3 geometryNormal, const in vec3 geometryViewDir, const in vec3 geometryClearcoatNormal, const in PhysicalMaterial material, inout ReflectedLight reflectedLight) {
	#ifdef USE_CLEARCOAT
		clearcoatSpecularIndirect += clearcoatRadiance * EnvironmentBRDF( geometryClearcoatNormal, geometryViewDir, material.clearcoatF0, material.clearcoatF90, material.clearcoatRoughness );
	#endif
	#ifdef USE_SHEEN
		sheenSpecularIndirect += irradiance * material.sheenColor * IBLSheenBRDF( geometryNormal, geometryViewDir, material.sheenRoughness ) * RECIPROCAL_PI;
 	#endif
	vec3 singleScatteringDielectric = vec3( 0.0 );
	vec3 multiScatteringDielectric = vec3( 0.0 );
	vec3 singleScatteringMetallic = vec3( 0.0 );
	vec3 multiScatteringMetallic = vec3( 0.0 );
	#ifdef USE_IRIDESCENCE
		computeMultiscatteringIridescence( material.dfg, material.specularColor, material.specularF90, material.iridescence, material.iridescenceF0Dielectric, singleScatteringDielectric, multiScatteringDielectric );
		computeMultiscatteringIridescence( material.dfg, material.diffuseColor, material.specularF90, material.iridescence, material.iridescenceF0Metallic, singleScatteringMetallic, multiScatteringMetallic );
	#else
		computeMultiscattering( material.dfg, material.specularColor, material.specularF90, singleScatteringDielectric, multiScatteringDielectric );
		computeMultiscattering( material.dfg, material.diffuseColor, material.specularF90, singleScatteringMetallic, multiScatteringMetallic );
	#endif
	vec3 singleScattering = mix( singleScatteringDielectric, singleScatteringMetallic, material.metalness );
	vec3 multiScattering = mix( multiScatteringDielectric, multiScatteringMetallic, material.metalness );
	vec3 totalScatteringDielectric = singleScatteringDielectric + multiScatteringDielectric;
	#ifdef USE_DIFFUSE_ROUGHNESS
		float dotNV = saturate( dot( geometryNormal, geometryViewDir ) );
		vec3 diffuse = EON_DirectionalAlbedo( material.diffuseColor, material.diffuseRoughness, dotNV ) * ( 1.0 - material.metalness ) * ( 1.0 - totalScatteringDielectric );
	#else
		vec3 diffuse = material.diffuseContribution * ( 1.0 - totalScatteringDielectric );
	#endif
	vec3 cosineWeightedIrradiance = irradiance * RECIPROCAL_PI;
	vec3 indirectSpecular = radiance * singleScattering;
	indirectSpecular += multiScattering * cosineWeightedIrradiance;
	vec3 indirectDiffuse = diffuse * cosineWeightedIrradiance;
	#ifdef USE_SHEEN
		float sheenAlbedo = IBLSheenBRDF( geometryNormal, geometryViewDir, material.sheenRoughness );
		float sheenEnergyComp = 1.0 - max3( material.sheenColor ) * sheenAlbedo;
		indirectSpecular *= sheenEnergyComp;
		indirectDiffuse *= sheenEnergyComp;
	#endif
	reflectedLight.indirectSpecular += indirectSpecular;
	reflectedLight.indirectDiffuse += indirectDiffuse;
}
#define RE_Direct				RE_Direct_Physical
#define RE_Direct_RectArea		RE_Direct_RectArea_Physical
#define RE_IndirectDiffuse		RE_IndirectDiffuse_Physical
#define RE_IndirectSpecular		RE_IndirectSpecular_Physical
float computeSpecularOcclusion( const in float dotNV, const in float ambientOcclusion, const in float roughness ) {
	return saturate( pow( dotNV + ambientOcclusion, exp2( - 16.0 * roughness - 1.0 ) ) - 1.0 + ambientOcclusion );
}`,ev=`
vec3 geometryPosition = - vViewPosition;
vec3 geometryNormal = normal;
vec3 geometryViewDir = ( isOrthographic ) ? vec3( 0, 0, 1 ) : normalize( vViewPosition );
vec3 geometryClearcoatNormal = vec3( 0.0 );
#ifdef USE_CLEARCOAT
	geometryClearcoatNormal = clearcoatNormal;
#endif
#ifdef USE_IRIDESCENCE
	float dotNVi = saturate( dot( normal, geometryViewDir ) );
	if ( material.iridescenceThickness == 0.0 ) {
		material.iridescence = 0.0;
	} else {
		material.iridescence = saturate( material.iridescence );
	}
	if ( material.iridescence > 0.0 ) {
		vec3 iridescenceFresnelDielectric = evalIridescence( 1.0, material.iridescenceIOR, dotNVi, material.iridescenceThickness, material.specularColor );
		vec3 iridescenceFresnelMetallic = evalIridescence( 1.0, material.iridescenceIOR, dotNVi, material.iridescenceThickness, material.diffuseColor );
		material.iridescenceFresnel = mix( iridescenceFresnelDielectric, iridescenceFresnelMetallic, material.metalness );
		material.iridescenceF0Dielectric = Schlick_to_F0( iridescenceFresnelDielectric, 1.0, dotNVi );
		material.iridescenceF0Metallic = Schlick_to_F0( iridescenceFresnelMetallic, 1.0, dotNVi );
	}
#endif
#ifdef STANDARD
	float dotNVms = saturate( dot( geometryNormal, geometryViewDir ) );
	material.dfg = texture2D( dfgLUT, vec2( material.roughness, dotNVms ) ).rg;
	#if ( NUM_SUN_LIGHTS > 0 || NUM_DIR_LIGHTS > 0 || NUM_POINT_LIGHTS > 0 || NUM_SPOT_LIGHTS > 0 )
		float EssMs = material.dfg.x + material.dfg.y;
		material.multiScatteringCompensation = 1.0 + material.specularColorBlended * ( 1.0 / EssMs - 1.0 );
	#endif
#endif
IncidentLight directLight;
#if ( NUM_POINT_LIGHTS > 0 ) && defined( RE_Direct )
	PointLight pointLight;
	#if defined( USE_SHADOWMAP ) && NUM_POINT_LIGHT_SHADOWS > 0
	PointLightShadow pointLightShadow;
	#endif
	#pragma unroll_loop_start
	for ( int i = 0; i < NUM_POINT_LIGHTS; i ++ ) {
		pointLight = pointLights[ i ];
		getPointLightInfo( pointLight, geometryPosition, directLight );
		#if defined( USE_SHADOWMAP ) && ( UNROLLED_LOOP_INDEX < NUM_POINT_LIGHT_SHADOWS ) && ( defined( SHADOWMAP_TYPE_PCF ) || defined( SHADOWMAP_TYPE_BASIC ) )
		pointLightShadow = pointLightShadows[ i ];
		directLight.color *= ( directLight.visible && receiveShadow ) ? getPointShadow( pointShadowMap[ i ], pointLightShadow.shadowMapSize, pointLightShadow.shadowIntensity, pointLightShadow.shadowBias, pointLightShadow.shadowRadius, vPointShadowCoord[ i ], pointLightShadow.shadowCameraNear, pointLightShadow.shadowCameraFar ) : 1.0;
		#endif
		RE_Direct( directLight, geometryPosition, geometryNormal, geometryViewDir, geometryClearcoatNormal, material, reflectedLight );
	}
	#pragma unroll_loop_end
#endif
#if ( NUM_SPOT_LIGHTS > 0 ) && defined( RE_Direct )
	SpotLight spotLight;
	vec4 spotColor;
	vec3 spotLightCoord;
	bool inSpotLightMap;
	#if defined( USE_SHADOWMAP ) && NUM_SPOT_LIGHT_SHADOWS > 0
	SpotLightShadow spotLightShadow;
	#endif
	#pragma unroll_loop_start
	for ( int i = 0; i < NUM_SPOT_LIGHTS; i ++ ) {
		spotLight = spotLights[ i ];
		getSpotLightInfo( spotLight, geometryPosition, directLight );
		#if ( UNROLLED_LOOP_INDEX < NUM_SPOT_LIGHT_SHADOWS_WITH_MAPS )
		#define SPOT_LIGHT_MAP_INDEX UNROLLED_LOOP_INDEX
		#elif ( UNROLLED_LOOP_INDEX < NUM_SPOT_LIGHT_SHADOWS )
		#define SPOT_LIGHT_MAP_INDEX NUM_SPOT_LIGHT_MAPS
		#else
		#define SPOT_LIGHT_MAP_INDEX ( UNROLLED_LOOP_INDEX - NUM_SPOT_LIGHT_SHADOWS + NUM_SPOT_LIGHT_SHADOWS_WITH_MAPS )
		#endif
		#if ( SPOT_LIGHT_MAP_INDEX < NUM_SPOT_LIGHT_MAPS )
			spotLightCoord = vSpotLightCoord[ i ].xyz / vSpotLightCoord[ i ].w;
			inSpotLightMap = all( lessThan( abs( spotLightCoord * 2. - 1. ), vec3( 1.0 ) ) );
			spotColor = texture2D( spotLightMap[ SPOT_LIGHT_MAP_INDEX ], spotLightCoord.xy );
			directLight.color = inSpotLightMap ? directLight.color * spotColor.rgb : directLight.color;
		#endif
		#undef SPOT_LIGHT_MAP_INDEX
		#if defined( USE_SHADOWMAP ) && ( UNROLLED_LOOP_INDEX < NUM_SPOT_LIGHT_SHADOWS )
		spotLightShadow = spotLightShadows[ i ];
		directLight.color *= ( directLight.visible && receiveShadow ) ? getShadow( spotShadowMap[ i ], spotLightShadow.shadowMapSize, spotLightShadow.shadowIntensity, spotLightShadow.shadowBias, spotLightShadow.shadowRadius, vSpotLightCoord[ i ] ) : 1.0;
		#endif
		RE_Direct( directLight, geometryPosition, geometryNormal, geometryViewDir, geometryClearcoatNormal, material, reflectedLight );
	}
	#pragma unroll_loop_end
#endif
#if ( NUM_SUN_LIGHTS > 0 ) && defined( RE_Direct )
	SunLight sunLight;
	#if defined( USE_SHADOWMAP ) && NUM_SUN_LIGHT_SHADOWS > 0
	SunLightShadow sunLightShadow;
	#endif
	#pragma unroll_loop_start
	for ( int i = 0; i < NUM_SUN_LIGHTS; i ++ ) {
		sunLight = sunLights[ i ];
		getSunLightInfo( sunLight, directLight );
		#if defined( USE_SHADOWMAP ) && ( UNROLLED_LOOP_INDEX < NUM_SUN_LIGHT_SHADOWS )
		sunLightShadow = sunLightShadows[ i ];
		directLight.color *= ( directLight.visible && receiveShadow ) ? getSunShadow( sunShadowMap[ i ], sunLightShadow, UNROLLED_LOOP_INDEX ) : 1.0;
		#endif
		RE_Direct( directLight, geometryPosition, geometryNormal, geometryViewDir, geometryClearcoatNormal, material, reflectedLight );
	}
	#pragma unroll_loop_end
#endif
#if ( NUM_DIR_LIGHTS > 0 ) && defined( RE_Direct )
	DirectionalLight directionalLight;
	#if defined( USE_SHADOWMAP ) && NUM_DIR_LIGHT_SHADOWS > 0
	DirectionalLightShadow directionalLightShadow;
	#endif
	#pragma unroll_loop_start
	for ( int i = 0; i < NUM_DIR_LIGHTS; i ++ ) {
		directionalLight = directionalLights[ i ];
		getDirectionalLightInfo( directionalLight, directLight );
		#if defined( USE_SHADOWMAP ) && ( UNROLLED_LOOP_INDEX < NUM_DIR_LIGHT_SHADOWS )
		directionalLightShadow = directionalLightShadows[ i ];
		directLight.color *= ( directLight.visible && receiveShadow ) ? getShadow( directionalShadowMap[ i ], directionalLightShadow.shadowMapSize, directionalLightShadow.shadowIntensity, directionalLightShadow.shadowBias, directionalLightShadow.shadowRadius, vDirectionalShadowCoord[ i ] ) : 1.0;
		#endif
		RE_Direct( directLight, geometryPosition, geometryNormal, geometryViewDir, geometryClearcoatNormal, material, reflectedLight );
	}
	#pragma unroll_loop_end
#endif
#if ( NUM_RECT_AREA_LIGHTS > 0 ) && defined( RE_Direct_RectArea )
	RectAreaLight rectAreaLight;
	#pragma unroll_loop_start
	for ( int i = 0; i < NUM_RECT_AREA_LIGHTS; i ++ ) {
		rectAreaLight = rectAreaLights[ i ];
		RE_Direct_RectArea( rectAreaLight, geometryPosition, geometryNormal, geometryViewDir, geometryClearcoatNormal, material, reflectedLight );
	}
	#pragma unroll_loop_end
#endif
#if defined( RE_IndirectDiffuse )
	vec3 iblIrradiance = vec3( 0.0 );
	vec3 irradiance = getAmbientLightIrradiance( ambientLightColor );
	#if defined( USE_LIGHT_PROBES )
		irradiance += getLightProbeIrradiance( lightProbe, geometryNormal );
	#endif
	#if ( NUM_HEMI_LIGHTS > 0 )
		#pragma unroll_loop_start
		for ( int i = 0; i < NUM_HEMI_LIGHTS; i ++ ) {
			irradiance += getHemisphereLightIrradiance( hemisphereLights[ i ], geometryNormal );
		}
		#pragma unroll_loop_end
	#endif
	#if NUM_LIGHT_PROBE_GRIDS > 0
		vec3 probeWorldPos = ( ( vec4( geometryPosition, 1.0 ) - viewMatrix[ 3 ] ) * viewMatrix ).xyz;
		vec3 probeWorldNormal = transformNormalByInverseViewMatrix( geometryNormal, viewMatrix );
		int probeGrid = - 1;
		#pragma unroll_loop_start
		for ( int i = 0; i < NUM_LIGHT_PROBE_GRIDS; i ++ ) {
			if ( isInsideLightProbeGrid( probeWorldPos, probeWorldNormal, probesMin[ i ], probesMax[ i ], probesResolution[ i ] ) ) probeGrid = UNROLLED_LOOP_INDEX;
		}
		#pragma unroll_loop_end
		#pragma unroll_loop_start
		for ( int i = 0; i < NUM_LIGHT_PROBE_GRIDS; i ++ ) {
			if ( probeGrid == UNROLLED_LOOP_INDEX ) irradiance += getLightProbeGridIrradiance( probesSH[ i ], probesMin[ i ], probesMax[ i ], probesResolution[ i ], probeWorldPos, probeWorldNormal );
		}
		#pragma unroll_loop_end
	#endif
#endif
#if defined( RE_IndirectSpecular )
	vec3 radiance = vec3( 0.0 );
	vec3 clearcoatRadiance = vec3( 0.0 );
#endif`,nv=`#if defined( RE_IndirectDiffuse )
	#ifdef USE_LIGHTMAP
		vec4 lightMapTexel = texture2D( lightMap, vLightMapUv );
		vec3 lightMapIrradiance = lightMapTexel.rgb * lightMapIntensity;
		irradiance += lightMapIrradiance;
	#endif
	#if defined( USE_ENVMAP ) && defined( ENVMAP_TYPE_PMREM )
		#if defined( STANDARD ) || defined( LAMBERT ) || defined( PHONG )
			iblIrradiance += getIBLIrradiance( geometryNormal );
		#endif
	#endif
#endif
#if defined( USE_ENVMAP ) && defined( RE_IndirectSpecular )
	#ifdef USE_ANISOTROPY
		vec3 iblRadiance = getIBLAnisotropyRadiance( geometryViewDir, geometryNormal, material.roughness, material.anisotropyB, material.anisotropy );
	#else
		vec3 iblRadiance = getIBLRadiance( geometryViewDir, geometryNormal, material.roughness );
	#endif
	#ifdef USE_RETROREFLECTION
		#ifdef USE_ANISOTROPY
			vec3 retroIBLRadiance = getIBLAnisotropyRetroRadiance( geometryViewDir, geometryNormal, material.roughness, material.anisotropyB, material.anisotropy );
		#else
			vec3 retroIBLRadiance = getIBLRetroRadiance( geometryViewDir, geometryNormal, material.roughness );
		#endif
		iblRadiance = mix( iblRadiance, retroIBLRadiance, saturate( material.retroreflectivity ) );
	#endif
	radiance += iblRadiance;
	#ifdef USE_CLEARCOAT
		clearcoatRadiance += getIBLRadiance( geometryViewDir, geometryClearcoatNormal, material.clearcoatRoughness );
	#endif
#endif`,iv=`#if defined( RE_IndirectDiffuse )
	#if defined( LAMBERT ) || defined( PHONG )
		irradiance += iblIrradiance;
	#endif
	RE_IndirectDiffuse( irradiance, geometryPosition, geometryNormal, geometryViewDir, geometryClearcoatNormal, material, reflectedLight );
#endif
#if defined( RE_IndirectSpecular )
	RE_IndirectSpecular( radiance, iblIrradiance, clearcoatRadiance, geometryPosition, geometryNormal, geometryViewDir, geometryClearcoatNormal, material, reflectedLight );
#endif`,sv=`#if NUM_LIGHT_PROBE_GRIDS > 0
uniform highp sampler3D probesSH[ NUM_LIGHT_PROBE_GRIDS ];
uniform vec3 probesMin[ NUM_LIGHT_PROBE_GRIDS ];
uniform vec3 probesMax[ NUM_LIGHT_PROBE_GRIDS ];
uniform vec3 probesResolution[ NUM_LIGHT_PROBE_GRIDS ];
bool isInsideLightProbeGrid( vec3 worldPos, vec3 worldNormal, vec3 probesMin, vec3 probesMax, vec3 probesResolution ) {
	vec3 spacing = ( probesMax - probesMin ) / probesResolution;
	vec3 samplePos = worldPos + worldNormal * spacing * 0.5;
	vec3 margin = spacing * 0.01;
	return all( greaterThanEqual( samplePos, probesMin - margin ) ) && all( lessThanEqual( samplePos, probesMax + margin ) );
}
vec3 getLightProbeGridIrradiance( highp sampler3D probesSH, vec3 probesMin, vec3 probesMax, vec3 probesResolution, vec3 worldPos, vec3 worldNormal ) {
	vec3 res = probesResolution;
	vec3 gridRange = probesMax - probesMin;
	vec3 probeSpacing = gridRange / res;
	vec3 samplePos = worldPos + worldNormal * probeSpacing * 0.5;
	vec3 uvw = clamp( ( samplePos - probesMin ) / gridRange, 0.5 / res, 1.0 - 0.5 / res );
	float nz          = res.z;
	float paddedSlices = nz + 2.0;
	float atlasDepth  = 7.0 * paddedSlices;
	float uvZBase     = uvw.z * nz + 1.0;
	vec4 s0 = texture( probesSH, vec3( uvw.xy, ( uvZBase                       ) / atlasDepth ) );
	vec4 s1 = texture( probesSH, vec3( uvw.xy, ( uvZBase +       paddedSlices   ) / atlasDepth ) );
	vec4 s2 = texture( probesSH, vec3( uvw.xy, ( uvZBase + 2.0 * paddedSlices   ) / atlasDepth ) );
	vec4 s3 = texture( probesSH, vec3( uvw.xy, ( uvZBase + 3.0 * paddedSlices   ) / atlasDepth ) );
	vec4 s4 = texture( probesSH, vec3( uvw.xy, ( uvZBase + 4.0 * paddedSlices   ) / atlasDepth ) );
	vec4 s5 = texture( probesSH, vec3( uvw.xy, ( uvZBase + 5.0 * paddedSlices   ) / atlasDepth ) );
	vec4 s6 = texture( probesSH, vec3( uvw.xy, ( uvZBase + 6.0 * paddedSlices   ) / atlasDepth ) );
	vec3 c0 = s0.xyz;
	vec3 c1 = vec3( s0.w, s1.xy );
	vec3 c2 = vec3( s1.zw, s2.x );
	vec3 c3 = s2.yzw;
	vec3 c4 = s3.xyz;
	vec3 c5 = vec3( s3.w, s4.xy );
	vec3 c6 = vec3( s4.zw, s5.x );
	vec3 c7 = s5.yzw;
	vec3 c8 = s6.xyz;
	float x = worldNormal.x, y = worldNormal.y, z = worldNormal.z;
	vec3 result = c0 * 0.886227;
	result += c1 * 2.0 * 0.511664 * y;
	result += c2 * 2.0 * 0.511664 * z;
	result += c3 * 2.0 * 0.511664 * x;
	result += c4 * 2.0 * 0.429043 * x * y;
	result += c5 * 2.0 * 0.429043 * y * z;
	result += c6 * ( 0.743125 * z * z - 0.247708 );
	result += c7 * 2.0 * 0.429043 * x * z;
	result += c8 * 0.429043 * ( x * x - y * y );
	return max( result, vec3( 0.0 ) );
}
#endif`,rv=`#if defined( USE_LOGARITHMIC_DEPTH_BUFFER )
	gl_FragDepth = vIsPerspective == 0.0 ? gl_FragCoord.z : log2( vFragDepth ) * logDepthBufFC * 0.5;
#endif`,ov=`#if defined( USE_LOGARITHMIC_DEPTH_BUFFER )
	uniform float logDepthBufFC;
	varying float vFragDepth;
	varying float vIsPerspective;
#endif`,av=`#ifdef USE_LOGARITHMIC_DEPTH_BUFFER
	varying float vFragDepth;
	varying float vIsPerspective;
#endif`,lv=`#ifdef USE_LOGARITHMIC_DEPTH_BUFFER
	vFragDepth = 1.0 + gl_Position.w;
	vIsPerspective = float( isPerspectiveMatrix( projectionMatrix ) );
#endif`,cv=`#ifdef USE_MAP
	vec4 sampledDiffuseColor = texture2D( map, vMapUv );
	#ifdef DECODE_VIDEO_TEXTURE
		sampledDiffuseColor = sRGBTransferEOTF( sampledDiffuseColor );
	#endif
	diffuseColor *= sampledDiffuseColor;
#endif`,hv=`#ifdef USE_MAP
	uniform sampler2D map;
#endif`,uv=`#if defined( USE_MAP ) || defined( USE_ALPHAMAP )
	#if defined( USE_POINTS_UV )
		vec2 uv = vUv;
	#else
		vec2 uv = ( uvTransform * vec3( gl_PointCoord.x, 1.0 - gl_PointCoord.y, 1 ) ).xy;
	#endif
#endif
#ifdef USE_MAP
	diffuseColor *= texture2D( map, uv );
#endif
#ifdef USE_ALPHAMAP
	diffuseColor.a *= texture2D( alphaMap, uv ).g;
#endif`,dv=`#if defined( USE_POINTS_UV )
	varying vec2 vUv;
#else
	#if defined( USE_MAP ) || defined( USE_ALPHAMAP )
		uniform mat3 uvTransform;
	#endif
#endif
#ifdef USE_MAP
	uniform sampler2D map;
#endif
#ifdef USE_ALPHAMAP
	uniform sampler2D alphaMap;
#endif`,fv=`float metalnessFactor = metalness;
#ifdef USE_METALNESSMAP
	vec4 texelMetalness = texture2D( metalnessMap, vMetalnessMapUv );
	metalnessFactor *= texelMetalness.b;
#endif`,pv=`#ifdef USE_METALNESSMAP
	uniform sampler2D metalnessMap;
#endif`,mv=`#ifdef USE_INSTANCING_MORPH
	float morphTargetInfluences[ MORPHTARGETS_COUNT ];
	float morphTargetBaseInfluence = texelFetch( morphTexture, ivec2( 0, gl_InstanceID ), 0 ).r;
	for ( int i = 0; i < MORPHTARGETS_COUNT; i ++ ) {
		morphTargetInfluences[i] =  texelFetch( morphTexture, ivec2( i + 1, gl_InstanceID ), 0 ).r;
	}
#endif`,gv=`#if defined( USE_MORPHCOLORS )
	#if defined( USE_COLOR_ALPHA )
		vColor *= morphTargetBaseInfluence;
	#elif defined( USE_COLOR )
		vColor.rgb *= morphTargetBaseInfluence;
	#endif
	for ( int i = 0; i < MORPHTARGETS_COUNT; i ++ ) {
		#if defined( USE_COLOR_ALPHA )
			if ( morphTargetInfluences[ i ] != 0.0 ) vColor += getMorph( gl_VertexID, i, 2 ) * morphTargetInfluences[ i ];
		#elif defined( USE_COLOR )
			if ( morphTargetInfluences[ i ] != 0.0 ) vColor.rgb += getMorph( gl_VertexID, i, 2 ).rgb * morphTargetInfluences[ i ];
		#endif
	}
#endif`,_v=`#ifdef USE_MORPHNORMALS
	objectNormal *= morphTargetBaseInfluence;
	for ( int i = 0; i < MORPHTARGETS_COUNT; i ++ ) {
		if ( morphTargetInfluences[ i ] != 0.0 ) objectNormal += getMorph( gl_VertexID, i, 1 ).xyz * morphTargetInfluences[ i ];
	}
#endif`,xv=`#ifdef USE_MORPHTARGETS
	#ifndef USE_INSTANCING_MORPH
		uniform float morphTargetBaseInfluence;
		uniform float morphTargetInfluences[ MORPHTARGETS_COUNT ];
	#endif
	uniform sampler2DArray morphTargetsTexture;
	uniform ivec2 morphTargetsTextureSize;
	vec4 getMorph( const in int vertexIndex, const in int morphTargetIndex, const in int offset ) {
		int texelIndex = vertexIndex * MORPHTARGETS_TEXTURE_STRIDE + offset;
		int y = texelIndex / morphTargetsTextureSize.x;
		int x = texelIndex - y * morphTargetsTextureSize.x;
		ivec3 morphUV = ivec3( x, y, morphTargetIndex );
		return texelFetch( morphTargetsTexture, morphUV, 0 );
	}
#endif`,yv=`#ifdef USE_MORPHTARGETS
	transformed *= morphTargetBaseInfluence;
	for ( int i = 0; i < MORPHTARGETS_COUNT; i ++ ) {
		if ( morphTargetInfluences[ i ] != 0.0 ) transformed += getMorph( gl_VertexID, i, 0 ).xyz * morphTargetInfluences[ i ];
	}
#endif`,vv=`float faceDirection = gl_FrontFacing ? 1.0 : - 1.0;
#ifdef FLAT_SHADED
	vec3 fdx = dFdx( vViewPosition );
	vec3 fdy = dFdy( vViewPosition );
	vec3 normal = normalize( cross( fdx, fdy ) );
#else
	vec3 normal = normalize( vNormal );
	#ifdef DOUBLE_SIDED
		normal *= faceDirection;
	#endif
#endif
#if defined( USE_NORMALMAP_TANGENTSPACE ) || defined( USE_CLEARCOAT_NORMALMAP ) || defined( USE_ANISOTROPY )
	#ifdef USE_TANGENT
		mat3 tbn = mat3( normalize( vTangent ), normalize( vBitangent ), normal );
	#else
		mat3 tbn = getTangentFrame( - vViewPosition, normal,
		#if defined( USE_NORMALMAP )
			vNormalMapUv
		#elif defined( USE_CLEARCOAT_NORMALMAP )
			vClearcoatNormalMapUv
		#else
			vUv
		#endif
		);
	#endif
	#ifdef DOUBLE_SIDED
		tbn[0] *= faceDirection;
		tbn[1] *= faceDirection;
	#endif
#endif
#ifdef USE_CLEARCOAT_NORMALMAP
	#ifdef USE_TANGENT
		mat3 tbn2 = mat3( normalize( vTangent ), normalize( vBitangent ), normal );
	#else
		mat3 tbn2 = getTangentFrame( - vViewPosition, normal, vClearcoatNormalMapUv );
	#endif
	#ifdef DOUBLE_SIDED
		tbn2[0] *= faceDirection;
		tbn2[1] *= faceDirection;
	#endif
#endif
vec3 nonPerturbedNormal = normal;`,Sv=`#ifdef USE_NORMALMAP_OBJECTSPACE
	normal = texture2D( normalMap, vNormalMapUv ).xyz * 2.0 - 1.0;
	#ifdef FLIP_SIDED
		normal = - normal;
	#endif
	#ifdef DOUBLE_SIDED
		normal = normal * faceDirection;
	#endif
	normal = normalize( normalMatrix * normal );
#elif defined( USE_NORMALMAP_TANGENTSPACE )
	vec3 mapN = texture2D( normalMap, vNormalMapUv ).xyz * 2.0 - 1.0;
	#if defined( USE_PACKED_NORMALMAP )
		mapN = vec3( mapN.xy, sqrt( saturate( 1.0 - dot( mapN.xy, mapN.xy ) ) ) );
	#endif
	mapN.xy *= normalScale;
	normal = normalize( tbn * mapN );
#elif defined( USE_BUMPMAP )
	normal = perturbNormalArb( - vViewPosition, normal, dHdxy_fwd(), faceDirection );
#endif`,bv=`#ifndef FLAT_SHADED
	varying vec3 vNormal;
	#ifdef USE_TANGENT
		varying vec3 vTangent;
		varying vec3 vBitangent;
	#endif
#endif`,Mv=`#ifndef FLAT_SHADED
	varying vec3 vNormal;
	#ifdef USE_TANGENT
		varying vec3 vTangent;
		varying vec3 vBitangent;
	#endif
#endif`,wv=`#ifndef FLAT_SHADED
	vNormal = normalize( transformedNormal );
	#ifdef USE_TANGENT
		vTangent = normalize( transformedTangent );
		vBitangent = normalize( cross( vNormal, vTangent ) * tangent.w );
		#ifdef FLIP_SIDED
			vBitangent = - vBitangent;
		#endif
	#endif
#endif`,Tv=`#ifdef USE_NORMALMAP
	uniform sampler2D normalMap;
	uniform vec2 normalScale;
#endif
#ifdef USE_NORMALMAP_OBJECTSPACE
	uniform mat3 normalMatrix;
#endif
#if ! defined ( USE_TANGENT ) && ( defined ( USE_NORMALMAP_TANGENTSPACE ) || defined ( USE_CLEARCOAT_NORMALMAP ) || defined( USE_ANISOTROPY ) )
	mat3 getTangentFrame( vec3 eye_pos, vec3 surf_norm, vec2 uv ) {
		vec3 q0 = dFdx( eye_pos.xyz );
		vec3 q1 = dFdy( eye_pos.xyz );
		vec2 st0 = dFdx( uv.st );
		vec2 st1 = dFdy( uv.st );
		vec3 N = surf_norm;
		vec3 q1perp = cross( q1, N );
		vec3 q0perp = cross( N, q0 );
		vec3 T = q1perp * st0.x + q0perp * st1.x;
		vec3 B = q1perp * st0.y + q0perp * st1.y;
		float det = max( dot( T, T ), dot( B, B ) );
		float scale = ( det == 0.0 ) ? 0.0 : inversesqrt( det );
		return mat3( T * scale, B * scale, N );
	}
#endif`,Av=`#ifdef USE_CLEARCOAT
	vec3 clearcoatNormal = nonPerturbedNormal;
#endif`,Ev=`#ifdef USE_CLEARCOAT_NORMALMAP
	vec3 clearcoatMapN = texture2D( clearcoatNormalMap, vClearcoatNormalMapUv ).xyz * 2.0 - 1.0;
	clearcoatMapN.xy *= clearcoatNormalScale;
	clearcoatNormal = normalize( tbn2 * clearcoatMapN );
#endif`,Cv=`#ifdef USE_CLEARCOATMAP
	uniform sampler2D clearcoatMap;
#endif
#ifdef USE_CLEARCOAT_NORMALMAP
	uniform sampler2D clearcoatNormalMap;
	uniform vec2 clearcoatNormalScale;
#endif
#ifdef USE_CLEARCOAT_ROUGHNESSMAP
	uniform sampler2D clearcoatRoughnessMap;
#endif`,Rv=`#ifdef USE_IRIDESCENCEMAP
	uniform sampler2D iridescenceMap;
#endif
#ifdef USE_IRIDESCENCE_THICKNESSMAP
	uniform sampler2D iridescenceThicknessMap;
#endif`,Iv=`#ifdef OPAQUE
diffuseColor.a = 1.0;
#endif
#ifdef USE_TRANSMISSION
diffuseColor.a *= material.transmissionAlpha;
#endif
gl_FragColor = vec4( outgoingLight, diffuseColor.a );`,Pv=`vec3 packNormalToRGB( const in vec3 normal ) {
	return normalize( normal ) * 0.5 + 0.5;
}
vec3 unpackRGBToNormal( const in vec3 rgb ) {
	return 2.0 * rgb.xyz - 1.0;
}
const float PackUpscale = 256. / 255.;const float UnpackDownscale = 255. / 256.;const float ShiftRight8 = 1. / 256.;
const float Inv255 = 1. / 255.;
const vec4 PackFactors = vec4( 1.0, 256.0, 256.0 * 256.0, 256.0 * 256.0 * 256.0 );
const vec2 UnpackFactors2 = vec2( UnpackDownscale, 1.0 / PackFactors.g );
const vec3 UnpackFactors3 = vec3( UnpackDownscale / PackFactors.rg, 1.0 / PackFactors.b );
const vec4 UnpackFactors4 = vec4( UnpackDownscale / PackFactors.rgb, 1.0 / PackFactors.a );
vec4 packDepthToRGBA( const in float v ) {
	if( v <= 0.0 )
		return vec4( 0., 0., 0., 0. );
	if( v >= 1.0 )
		return vec4( 1., 1., 1., 1. );
	float vuf;
	float af = modf( v * PackFactors.a, vuf );
	float bf = modf( vuf * ShiftRight8, vuf );
	float gf = modf( vuf * ShiftRight8, vuf );
	return vec4( vuf * Inv255, gf * PackUpscale, bf * PackUpscale, af );
}
vec3 packDepthToRGB( const in float v ) {
	if( v <= 0.0 )
		return vec3( 0., 0., 0. );
	if( v >= 1.0 )
		return vec3( 1., 1., 1. );
	float vuf;
	float bf = modf( v * PackFactors.b, vuf );
	float gf = modf( vuf * ShiftRight8, vuf );
	return vec3( vuf * Inv255, gf * PackUpscale, bf );
}
vec2 packDepthToRG( const in float v ) {
	if( v <= 0.0 )
		return vec2( 0., 0. );
	if( v >= 1.0 )
		return vec2( 1., 1. );
	float vuf;
	float gf = modf( v * 256., vuf );
	return vec2( vuf * Inv255, gf );
}
float unpackRGBAToDepth( const in vec4 v ) {
	return dot( v, UnpackFactors4 );
}
float unpackRGBToDepth( const in vec3 v ) {
	return dot( v, UnpackFactors3 );
}
float unpackRGToDepth( const in vec2 v ) {
	return v.r * UnpackFactors2.r + v.g * UnpackFactors2.g;
}
vec4 pack2HalfToRGBA( const in vec2 v ) {
	vec4 r = vec4( v.x, fract( v.x * 255.0 ), v.y, fract( v.y * 255.0 ) );
	return vec4( r.x - r.y / 255.0, r.y, r.z - r.w / 255.0, r.w );
}
vec2 unpackRGBATo2Half( const in vec4 v ) {
	return vec2( v.x + ( v.y / 255.0 ), v.z + ( v.w / 255.0 ) );
}
float viewZToOrthographicDepth( const in float viewZ, const in float near, const in float far ) {
	return ( viewZ + near ) / ( near - far );
}
float orthographicDepthToViewZ( const in float depth, const in float near, const in float far ) {
	#ifdef USE_REVERSED_DEPTH_BUFFER
	
		return depth * ( far - near ) - far;
	#else
		return depth * ( near - far ) - near;
	#endif
}
float viewZToPerspectiveDepth( const in float viewZ, const in float near, const in float far ) {
	return ( ( near + viewZ ) * far ) / ( ( far - near ) * viewZ );
}
float perspectiveDepthToViewZ( const in float depth, const in float near, const in float far ) {
	
	#ifdef USE_REVERSED_DEPTH_BUFFER
		return ( near * far ) / ( ( near - far ) * depth - near );
	#else
		return ( near * far ) / ( ( far - near ) * depth - far );
	#endif
}`,Lv=`#ifdef PREMULTIPLIED_ALPHA
	gl_FragColor.rgb *= gl_FragColor.a;
#endif`,Dv=`vec4 mvPosition = vec4( transformed, 1.0 );
#ifdef USE_BATCHING
	mvPosition = batchingMatrix * mvPosition;
#endif
#ifdef USE_INSTANCING
	mvPosition = instanceMatrix * mvPosition;
#endif
mvPosition = modelViewMatrix * mvPosition;
gl_Position = projectionMatrix * mvPosition;`,Nv=`#ifdef DITHERING
	gl_FragColor.rgb = dithering( gl_FragColor.rgb );
#endif`,Uv=`#ifdef DITHERING
	vec3 dithering( vec3 color ) {
		float grid_position = rand( gl_FragCoord.xy );
		vec3 dither_shift_RGB = vec3( 0.25 / 255.0, -0.25 / 255.0, 0.25 / 255.0 );
		dither_shift_RGB = mix( 2.0 * dither_shift_RGB, -2.0 * dither_shift_RGB, grid_position );
		return color + dither_shift_RGB;
	}
#endif`,Ov=`float roughnessFactor = roughness;
#ifdef USE_ROUGHNESSMAP
	vec4 texelRoughness = texture2D( roughnessMap, vRoughnessMapUv );
	roughnessFactor *= texelRoughness.g;
#endif`,Fv=`#ifdef USE_ROUGHNESSMAP
	uniform sampler2D roughnessMap;
#endif`,Bv=`#if NUM_SPOT_LIGHT_COORDS > 0
	varying vec4 vSpotLightCoord[ NUM_SPOT_LIGHT_COORDS ];
#endif
#if NUM_SPOT_LIGHT_MAPS > 0
	uniform sampler2D spotLightMap[ NUM_SPOT_LIGHT_MAPS ];
#endif
#ifdef USE_SHADOWMAP
	#if NUM_SUN_LIGHT_SHADOWS > 0
		#define SUN_LIGHT_CASCADES 2
		#if defined( SHADOWMAP_TYPE_PCF )
			uniform sampler2DShadow sunShadowMap[ NUM_SUN_LIGHT_SHADOWS ];
		#else
			uniform sampler2D sunShadowMap[ NUM_SUN_LIGHT_SHADOWS ];
		#endif
		uniform mat4 sunShadowMatrix[ NUM_SUN_LIGHT_SHADOWS * SUN_LIGHT_CASCADES ];
		uniform vec4 sunShadowCascade[ NUM_SUN_LIGHT_SHADOWS * SUN_LIGHT_CASCADES ];
		varying vec4 vSunShadowWorldPosition;
		varying vec3 vSunShadowWorldNormal;
		struct SunLightShadow {
			float shadowIntensity;
			float shadowBias;
			float shadowNormalBias;
			float shadowRadius;
			vec2 shadowMapSize;
		};
		uniform SunLightShadow sunLightShadows[ NUM_SUN_LIGHT_SHADOWS ];
	#endif
	#if NUM_DIR_LIGHT_SHADOWS > 0
		#if defined( SHADOWMAP_TYPE_PCF )
			uniform sampler2DShadow directionalShadowMap[ NUM_DIR_LIGHT_SHADOWS ];
		#else
			uniform sampler2D directionalShadowMap[ NUM_DIR_LIGHT_SHADOWS ];
		#endif
		varying vec4 vDirectionalShadowCoord[ NUM_DIR_LIGHT_SHADOWS ];
		struct DirectionalLightShadow {
			float shadowIntensity;
			float shadowBias;
			float shadowNormalBias;
			float shadowRadius;
			vec2 shadowMapSize;
		};
		uniform DirectionalLightShadow directionalLightShadows[ NUM_DIR_LIGHT_SHADOWS ];
	#endif
	#if NUM_SPOT_LIGHT_SHADOWS > 0
		#if defined( SHADOWMAP_TYPE_PCF )
			uniform sampler2DShadow spotShadowMap[ NUM_SPOT_LIGHT_SHADOWS ];
		#else
			uniform sampler2D spotShadowMap[ NUM_SPOT_LIGHT_SHADOWS ];
		#endif
		struct SpotLightShadow {
			float shadowIntensity;
			float shadowBias;
			float shadowNormalBias;
			float shadowRadius;
			vec2 shadowMapSize;
		};
		uniform SpotLightShadow spotLightShadows[ NUM_SPOT_LIGHT_SHADOWS ];
	#endif
	#if NUM_POINT_LIGHT_SHADOWS > 0
		#if defined( SHADOWMAP_TYPE_PCF )
			uniform samplerCubeShadow pointShadowMap[ NUM_POINT_LIGHT_SHADOWS ];
		#elif defined( SHADOWMAP_TYPE_BASIC )
			uniform samplerCube pointShadowMap[ NUM_POINT_LIGHT_SHADOWS ];
		#endif
		varying vec4 vPointShadowCoord[ NUM_POINT_LIGHT_SHADOWS ];
		struct PointLightShadow {
			float shadowIntensity;
			float shadowBias;
			float shadowNormalBias;
			float shadowRadius;
			vec2 shadowMapSize;
			float shadowCameraNear;
			float shadowCameraFar;
		};
		uniform PointLightShadow pointLightShadows[ NUM_POINT_LIGHT_SHADOWS ];
	#endif
	#if defined( SHADOWMAP_TYPE_PCF )
		float interleavedGradientNoise( vec2 position ) {
			return fract( 52.9829189 * fract( dot( position, vec2( 0.06711056, 0.00583715 ) ) ) );
		}
		vec2 vogelDiskSample( int sampleIndex, int samplesCount, float phi ) {
			const float goldenAngle = 2.399963229728653;
			float r = sqrt( ( float( sampleIndex ) + 0.5 ) / float( samplesCount ) );
			float theta = float( sampleIndex ) * goldenAngle + phi;
			return vec2( cos( theta ), sin( theta ) ) * r;
		}
	#endif
	#if defined( SHADOWMAP_TYPE_PCF )
		float getShadow( sampler2DShadow shadowMap, vec2 shadowMapSize, float shadowIntensity, float shadowBias, float shadowRadius, vec4 shadowCoord ) {
			float shadow = 1.0;
			shadowCoord.xyz /= shadowCoord.w;
			#ifdef USE_REVERSED_DEPTH_BUFFER
				shadowCoord.z -= shadowBias;
			#else
				shadowCoord.z += shadowBias;
			#endif
			bool inFrustum = shadowCoord.x >= 0.0 && shadowCoord.x <= 1.0 && shadowCoord.y >= 0.0 && shadowCoord.y <= 1.0;
			bool frustumTest = inFrustum && shadowCoord.z <= 1.0;
			if ( frustumTest ) {
				vec2 texelSize = vec2( 1.0 ) / shadowMapSize;
				vec2 radius = shadowRadius * texelSize;
				float phi = interleavedGradientNoise( gl_FragCoord.xy ) * PI2;
				shadow = (
					texture( shadowMap, vec3( shadowCoord.xy + vogelDiskSample( 0, 5, phi ) * radius, shadowCoord.z ) ) +
					texture( shadowMap, vec3( shadowCoord.xy + vogelDiskSample( 1, 5, phi ) * radius, shadowCoord.z ) ) +
					texture( shadowMap, vec3( shadowCoord.xy + vogelDiskSample( 2, 5, phi ) * radius, shadowCoord.z ) ) +
					texture( shadowMap, vec3( shadowCoord.xy + vogelDiskSample( 3, 5, phi ) * radius, shadowCoord.z ) ) +
					texture( shadowMap, vec3( shadowCoord.xy + vogelDiskSample( 4, 5, phi ) * radius, shadowCoord.z ) )
				) * 0.2;
			}
			return mix( 1.0, shadow, shadowIntensity );
		}
	#elif defined( SHADOWMAP_TYPE_VSM )
		float getShadow( sampler2D shadowMap, vec2 shadowMapSize, float shadowIntensity, float shadowBias, float shadowRadius, vec4 shadowCoord ) {
			float shadow = 1.0;
			shadowCoord.xyz /= shadowCoord.w;
			#ifdef USE_REVERSED_DEPTH_BUFFER
				shadowCoord.z -= shadowBias;
			#else
				shadowCoord.z += shadowBias;
			#endif
			bool inFrustum = shadowCoord.x >= 0.0 && shadowCoord.x <= 1.0 && shadowCoord.y >= 0.0 && shadowCoord.y <= 1.0;
			bool frustumTest = inFrustum && shadowCoord.z <= 1.0;
			if ( frustumTest ) {
				vec2 distribution = texture2D( shadowMap, shadowCoord.xy ).rg;
				float mean = distribution.x;
				float variance = distribution.y * distribution.y;
				#ifdef USE_REVERSED_DEPTH_BUFFER
					float hard_shadow = step( mean, shadowCoord.z );
				#else
					float hard_shadow = step( shadowCoord.z, mean );
				#endif
				
				if ( hard_shadow == 1.0 ) {
					shadow = 1.0;
				} else {
					variance = max( variance, 0.0000001 );
					float d = shadowCoord.z - mean;
					float p_max = variance / ( variance + d * d );
					p_max = clamp( ( p_max - 0.3 ) / 0.65, 0.0, 1.0 );
					shadow = max( hard_shadow, p_max );
				}
			}
			return mix( 1.0, shadow, shadowIntensity );
		}
	#else
		float getShadow( sampler2D shadowMap, vec2 shadowMapSize, float shadowIntensity, float shadowBias, float shadowRadius, vec4 shadowCoord ) {
			float shadow = 1.0;
			shadowCoord.xyz /= shadowCoord.w;
			#ifdef USE_REVERSED_DEPTH_BUFFER
				shadowCoord.z -= shadowBias;
			#else
				shadowCoord.z += shadowBias;
			#endif
			bool inFrustum = shadowCoord.x >= 0.0 && shadowCoord.x <= 1.0 && shadowCoord.y >= 0.0 && shadowCoord.y <= 1.0;
			bool frustumTest = inFrustum && shadowCoord.z <= 1.0;
			if ( frustumTest ) {
				float depth = texture2D( shadowMap, shadowCoord.xy ).r;
				#ifdef USE_REVERSED_DEPTH_BUFFER
					shadow = step( depth, shadowCoord.z );
				#else
					shadow = step( shadowCoord.z, depth );
				#endif
			}
			return mix( 1.0, shadow, shadowIntensity );
		}
	#endif
	#if NUM_SUN_LIGHT_SHADOWS > 0
		float getSunShadow(
			#if defined( SHADOWMAP_TYPE_PCF )
				sampler2DShadow shadowMap,
			#else
				sampler2D shadowMap,
			#endif
			SunLightShadow sunLightShadow,
			int shadowIndex
		) {
			vec4 shadowWorldPosition = vec4( vSunShadowWorldPosition.xyz + vSunShadowWorldNormal * sunLightShadow.shadowNormalBias, 1.0 );
			float viewDepth = vSunShadowWorldPosition.w;
			int cascadeOffset = shadowIndex * SUN_LIGHT_CASCADES;
			float shadow = 1.0;
			for ( int i = SUN_LIGHT_CASCADES - 1; i >= 0; i -- ) {
				vec4 cascade = sunShadowCascade[ cascadeOffset + i ];
				if ( viewDepth >= cascade.x && viewDepth < cascade.y ) {
					float cascadeShadow = getShadow(
						shadowMap,
						sunLightShadow.shadowMapSize,
						sunLightShadow.shadowIntensity,
						sunLightShadow.shadowBias,
						sunLightShadow.shadowRadius,
						sunShadowMatrix[ cascadeOffset + i ] * shadowWorldPosition
					);
					shadow = mix( cascadeShadow, shadow, smoothstep( cascade.z, cascade.y, viewDepth ) );
				}
			}
			return shadow;
		}
	#endif
	#if NUM_POINT_LIGHT_SHADOWS > 0
	#if defined( SHADOWMAP_TYPE_PCF )
	float getPointShadow( samplerCubeShadow shadowMap, vec2 shadowMapSize, float shadowIntensity, float shadowBias, float shadowRadius, vec4 shadowCoord, float shadowCameraNear, float shadowCameraFar ) {
		float shadow = 1.0;
		vec3 lightToPosition = shadowCoord.xyz;
		vec3 bd3D = normalize( lightToPosition );
		vec3 absVec = abs( lightToPosition );
		float viewSpaceZ = max( max( absVec.x, absVec.y ), absVec.z );
		if ( viewSpaceZ - shadowCameraFar <= 0.0 && viewSpaceZ - shadowCameraNear >= 0.0 ) {
			float lightDistance = length( lightToPosition );
			float depthRange = shadowCameraFar - shadowCameraNear;
			#ifdef USE_REVERSED_DEPTH_BUFFER
				float depthA = - shadowCameraNear / depthRange - shadowBias;
				float depthB = shadowCameraNear * shadowCameraFar / ( depthRange * lightDistance );
			#else
				float depthA = shadowCameraFar / depthRange + shadowBias;
				float depthB = - shadowCameraNear * shadowCameraFar / ( depthRange * lightDistance );
			#endif
			float texelSize = shadowRadius / shadowMapSize.x;
			vec3 absDir = abs( bd3D );
			vec3 tangent = absDir.x > absDir.z ? vec3( 0.0, 1.0, 0.0 ) : vec3( 1.0, 0.0, 0.0 );
			tangent = normalize( cross( bd3D, tangent ) );
			vec3 bitangent = cross( bd3D, tangent );
			float phi = interleavedGradientNoise( gl_FragCoord.xy ) * PI2;
			shadow = 0.0;
			for ( int i = 0; i < 5; i ++ ) {
				vec2 offset = vogelDiskSample( i, 5, phi );
				vec3 direction = bd3D + ( tangent * offset.x + bitangent * offset.y ) * texelSize;
				vec3 absDirection = abs( direction );
				float dp = depthA + depthB / max( max( absDirection.x, absDirection.y ), absDirection.z );
				shadow += texture( shadowMap, vec4( direction, dp ) );
			}
			shadow *= 0.2;
		}
		return mix( 1.0, shadow, shadowIntensity );
	}
	#elif defined( SHADOWMAP_TYPE_BASIC )
	float getPointShadow( samplerCube shadowMap, vec2 shadowMapSize, float shadowIntensity, float shadowBias, float shadowRadius, vec4 shadowCoord, float shadowCameraNear, float shadowCameraFar ) {
		float shadow = 1.0;
		vec3 lightToPosition = shadowCoord.xyz;
		vec3 absVec = abs( lightToPosition );
		float viewSpaceZ = max( max( absVec.x, absVec.y ), absVec.z );
		if ( viewSpaceZ - shadowCameraFar <= 0.0 && viewSpaceZ - shadowCameraNear >= 0.0 ) {
			float dp = ( shadowCameraFar * ( viewSpaceZ - shadowCameraNear ) ) / ( viewSpaceZ * ( shadowCameraFar - shadowCameraNear ) );
			dp += shadowBias;
			vec3 bd3D = normalize( lightToPosition );
			float depth = textureCube( shadowMap, bd3D ).r;
			#ifdef USE_REVERSED_DEPTH_BUFFER
				depth = 1.0 - depth;
			#endif
			shadow = step( dp, depth );
		}
		return mix( 1.0, shadow, shadowIntensity );
	}
	#endif
	#endif
#endif`,kv=`#if NUM_SPOT_LIGHT_COORDS > 0
	uniform mat4 spotLightMatrix[ NUM_SPOT_LIGHT_COORDS ];
	varying vec4 vSpotLightCoord[ NUM_SPOT_LIGHT_COORDS ];
#endif
#ifdef USE_SHADOWMAP
	#if NUM_SUN_LIGHT_SHADOWS > 0
		varying vec4 vSunShadowWorldPosition;
		varying vec3 vSunShadowWorldNormal;
	#endif
	#if NUM_DIR_LIGHT_SHADOWS > 0
		uniform mat4 directionalShadowMatrix[ NUM_DIR_LIGHT_SHADOWS ];
		varying vec4 vDirectionalShadowCoord[ NUM_DIR_LIGHT_SHADOWS ];
		struct DirectionalLightShadow {
			float shadowIntensity;
			float shadowBias;
			float shadowNormalBias;
			float shadowRadius;
			vec2 shadowMapSize;
		};
		uniform DirectionalLightShadow directionalLightShadows[ NUM_DIR_LIGHT_SHADOWS ];
	#endif
	#if NUM_SPOT_LIGHT_SHADOWS > 0
		struct SpotLightShadow {
			float shadowIntensity;
			float shadowBias;
			float shadowNormalBias;
			float shadowRadius;
			vec2 shadowMapSize;
		};
		uniform SpotLightShadow spotLightShadows[ NUM_SPOT_LIGHT_SHADOWS ];
	#endif
	#if NUM_POINT_LIGHT_SHADOWS > 0
		uniform mat4 pointShadowMatrix[ NUM_POINT_LIGHT_SHADOWS ];
		varying vec4 vPointShadowCoord[ NUM_POINT_LIGHT_SHADOWS ];
		struct PointLightShadow {
			float shadowIntensity;
			float shadowBias;
			float shadowNormalBias;
			float shadowRadius;
			vec2 shadowMapSize;
			float shadowCameraNear;
			float shadowCameraFar;
		};
		uniform PointLightShadow pointLightShadows[ NUM_POINT_LIGHT_SHADOWS ];
	#endif
#endif`,zv=`#if ( defined( USE_SHADOWMAP ) && ( NUM_DIR_LIGHT_SHADOWS > 0 || NUM_SUN_LIGHT_SHADOWS > 0 || NUM_POINT_LIGHT_SHADOWS > 0 ) ) || ( NUM_SPOT_LIGHT_COORDS > 0 )
	#ifdef HAS_NORMAL
		vec3 shadowWorldNormal = transformNormalByInverseViewMatrix( transformedNormal, viewMatrix );
	#else
		vec3 shadowWorldNormal = vec3( 0.0 );
	#endif
	vec4 shadowWorldPosition;
#endif
#if defined( USE_SHADOWMAP )
	#if NUM_SUN_LIGHT_SHADOWS > 0
		vSunShadowWorldPosition = vec4( worldPosition.xyz, - mvPosition.z );
		vSunShadowWorldNormal = shadowWorldNormal;
	#endif
	#if NUM_DIR_LIGHT_SHADOWS > 0
		#pragma unroll_loop_start
		for ( int i = 0; i < NUM_DIR_LIGHT_SHADOWS; i ++ ) {
			shadowWorldPosition = worldPosition + vec4( shadowWorldNormal * directionalLightShadows[ i ].shadowNormalBias, 0 );
			vDirectionalShadowCoord[ i ] = directionalShadowMatrix[ i ] * shadowWorldPosition;
		}
		#pragma unroll_loop_end
	#endif
	#if NUM_POINT_LIGHT_SHADOWS > 0
		#pragma unroll_loop_start
		for ( int i = 0; i < NUM_POINT_LIGHT_SHADOWS; i ++ ) {
			shadowWorldPosition = worldPosition + vec4( shadowWorldNormal * pointLightShadows[ i ].shadowNormalBias, 0 );
			vPointShadowCoord[ i ] = pointShadowMatrix[ i ] * shadowWorldPosition;
		}
		#pragma unroll_loop_end
	#endif
#endif
#if NUM_SPOT_LIGHT_COORDS > 0
	#pragma unroll_loop_start
	for ( int i = 0; i < NUM_SPOT_LIGHT_COORDS; i ++ ) {
		shadowWorldPosition = worldPosition;
		#if ( defined( USE_SHADOWMAP ) && UNROLLED_LOOP_INDEX < NUM_SPOT_LIGHT_SHADOWS )
			shadowWorldPosition.xyz += shadowWorldNormal * spotLightShadows[ i ].shadowNormalBias;
		#endif
		vSpotLightCoord[ i ] = spotLightMatrix[ i ] * shadowWorldPosition;
	}
	#pragma unroll_loop_end
#endif`,Vv=`float getShadowMask() {
	float shadow = 1.0;
	#ifdef USE_SHADOWMAP
	#if NUM_SUN_LIGHT_SHADOWS > 0
	SunLightShadow sunLight;
	#pragma unroll_loop_start
	for ( int i = 0; i < NUM_SUN_LIGHT_SHADOWS; i ++ ) {
		sunLight = sunLightShadows[ i ];
		shadow *= receiveShadow ? getSunShadow( sunShadowMap[ i ], sunLight, UNROLLED_LOOP_INDEX ) : 1.0;
	}
	#pragma unroll_loop_end
	#endif
	#if NUM_DIR_LIGHT_SHADOWS > 0
	DirectionalLightShadow directionalLight;
	#pragma unroll_loop_start
	for ( int i = 0; i < NUM_DIR_LIGHT_SHADOWS; i ++ ) {
		directionalLight = directionalLightShadows[ i ];
		shadow *= receiveShadow ? getShadow( directionalShadowMap[ i ], directionalLight.shadowMapSize, directionalLight.shadowIntensity, directionalLight.shadowBias, directionalLight.shadowRadius, vDirectionalShadowCoord[ i ] ) : 1.0;
	}
	#pragma unroll_loop_end
	#endif
	#if NUM_SPOT_LIGHT_SHADOWS > 0
	SpotLightShadow spotLight;
	#pragma unroll_loop_start
	for ( int i = 0; i < NUM_SPOT_LIGHT_SHADOWS; i ++ ) {
		spotLight = spotLightShadows[ i ];
		shadow *= receiveShadow ? getShadow( spotShadowMap[ i ], spotLight.shadowMapSize, spotLight.shadowIntensity, spotLight.shadowBias, spotLight.shadowRadius, vSpotLightCoord[ i ] ) : 1.0;
	}
	#pragma unroll_loop_end
	#endif
	#if NUM_POINT_LIGHT_SHADOWS > 0 && ( defined( SHADOWMAP_TYPE_PCF ) || defined( SHADOWMAP_TYPE_BASIC ) )
	PointLightShadow pointLight;
	#pragma unroll_loop_start
	for ( int i = 0; i < NUM_POINT_LIGHT_SHADOWS; i ++ ) {
		pointLight = pointLightShadows[ i ];
		shadow *= receiveShadow ? getPointShadow( pointShadowMap[ i ], pointLight.shadowMapSize, pointLight.shadowIntensity, pointLight.shadowBias, pointLight.shadowRadius, vPointShadowCoord[ i ], pointLight.shadowCameraNear, pointLight.shadowCameraFar ) : 1.0;
	}
	#pragma unroll_loop_end
	#endif
	#endif
	return shadow;
}`,Gv=`#ifdef USE_SKINNING
	mat4 boneMatX = getBoneMatrix( skinIndex.x );
	mat4 boneMatY = getBoneMatrix( skinIndex.y );
	mat4 boneMatZ = getBoneMatrix( skinIndex.z );
	mat4 boneMatW = getBoneMatrix( skinIndex.w );
#endif`,Hv=`#ifdef USE_SKINNING
	uniform mat4 bindMatrix;
	uniform mat4 bindMatrixInverse;
	uniform highp sampler2D boneTexture;
	mat4 getBoneMatrix( const in float i ) {
		int size = textureSize( boneTexture, 0 ).x;
		int j = int( i ) * 4;
		int x = j % size;
		int y = j / size;
		vec4 v1 = texelFetch( boneTexture, ivec2( x, y ), 0 );
		vec4 v2 = texelFetch( boneTexture, ivec2( x + 1, y ), 0 );
		vec4 v3 = texelFetch( boneTexture, ivec2( x + 2, y ), 0 );
		vec4 v4 = texelFetch( boneTexture, ivec2( x + 3, y ), 0 );
		return mat4( v1, v2, v3, v4 );
	}
#endif`,Wv=`#ifdef USE_SKINNING
	vec4 skinVertex = bindMatrix * vec4( transformed, 1.0 );
	vec4 skinned = vec4( 0.0 );
	skinned += boneMatX * skinVertex * skinWeight.x;
	skinned += boneMatY * skinVertex * skinWeight.y;
	skinned += boneMatZ * skinVertex * skinWeight.z;
	skinned += boneMatW * skinVertex * skinWeight.w;
	transformed = ( bindMatrixInverse * skinned ).xyz;
#endif`,Xv=`#ifdef USE_SKINNING
	mat4 skinMatrix = mat4( 0.0 );
	skinMatrix += skinWeight.x * boneMatX;
	skinMatrix += skinWeight.y * boneMatY;
	skinMatrix += skinWeight.z * boneMatZ;
	skinMatrix += skinWeight.w * boneMatW;
	skinMatrix = bindMatrixInverse * skinMatrix * bindMatrix;
	objectNormal = vec4( skinMatrix * vec4( objectNormal, 0.0 ) ).xyz;
	#ifdef USE_TANGENT
		objectTangent = vec4( skinMatrix * vec4( objectTangent, 0.0 ) ).xyz;
	#endif
#endif`,qv=`float specularStrength;
#ifdef USE_SPECULARMAP
	vec4 texelSpecular = texture2D( specularMap, vSpecularMapUv );
	specularStrength = texelSpecular.r;
#else
	specularStrength = 1.0;
#endif`,Yv=`#ifdef USE_SPECULARMAP
	uniform sampler2D specularMap;
#endif`,$v=`#if defined( TONE_MAPPING )
	gl_FragColor.rgb = toneMapping( gl_FragColor.rgb );
#endif`,Kv=`#ifndef saturate
#define saturate( a ) clamp( a, 0.0, 1.0 )
#endif
uniform float toneMappingExposure;
vec3 LinearToneMapping( vec3 color ) {
	return saturate( toneMappingExposure * color );
}
vec3 ReinhardToneMapping( vec3 color ) {
	color *= toneMappingExposure;
	return saturate( color / ( vec3( 1.0 ) + color ) );
}
vec3 CineonToneMapping( vec3 color ) {
	color *= toneMappingExposure;
	color = max( vec3( 0.0 ), color - 0.004 );
	return pow( ( color * ( 6.2 * color + 0.5 ) ) / ( color * ( 6.2 * color + 1.7 ) + 0.06 ), vec3( 2.2 ) );
}
vec3 RRTAndODTFit( vec3 v ) {
	vec3 a = v * ( v + 0.0245786 ) - 0.000090537;
	vec3 b = v * ( 0.983729 * v + 0.4329510 ) + 0.238081;
	return a / b;
}
vec3 ACESFilmicToneMapping( vec3 color ) {
	const mat3 ACESInputMat = mat3(
		vec3( 0.59719, 0.07600, 0.02840 ),		vec3( 0.35458, 0.90834, 0.13383 ),
		vec3( 0.04823, 0.01566, 0.83777 )
	);
	const mat3 ACESOutputMat = mat3(
		vec3(  1.60475, -0.10208, -0.00327 ),		vec3( -0.53108,  1.10813, -0.07276 ),
		vec3( -0.07367, -0.00605,  1.07602 )
	);
	color *= toneMappingExposure / 0.6;
	color = ACESInputMat * color;
	color = RRTAndODTFit( color );
	color = ACESOutputMat * color;
	return saturate( color );
}
const mat3 LINEAR_REC2020_TO_LINEAR_SRGB = mat3(
	vec3( 1.6605, - 0.1246, - 0.0182 ),
	vec3( - 0.5876, 1.1329, - 0.1006 ),
	vec3( - 0.0728, - 0.0083, 1.1187 )
);
const mat3 LINEAR_SRGB_TO_LINEAR_REC2020 = mat3(
	vec3( 0.6274, 0.0691, 0.0164 ),
	vec3( 0.3293, 0.9195, 0.0880 ),
	vec3( 0.0433, 0.0113, 0.8956 )
);
vec3 agxDefaultContrastApprox( vec3 x ) {
	vec3 x2 = x * x;
	vec3 x4 = x2 * x2;
	return + 15.5 * x4 * x2
		- 40.14 * x4 * x
		+ 31.96 * x4
		- 6.868 * x2 * x
		+ 0.4298 * x2
		+ 0.1191 * x
		- 0.00232;
}
vec3 AgXToneMapping( vec3 color ) {
	const mat3 AgXInsetMatrix = mat3(
		vec3( 0.856627153315983, 0.137318972929847, 0.11189821299995 ),
		vec3( 0.0951212405381588, 0.761241990602591, 0.0767994186031903 ),
		vec3( 0.0482516061458583, 0.101439036467562, 0.811302368396859 )
	);
	const mat3 AgXOutsetMatrix = mat3(
		vec3( 1.1271005818144368, - 0.1413297634984383, - 0.14132976349843826 ),
		vec3( - 0.11060664309660323, 1.157823702216272, - 0.11060664309660294 ),
		vec3( - 0.016493938717834573, - 0.016493938717834257, 1.2519364065950405 )
	);
	const float AgxMinEv = - 12.47393;	const float AgxMaxEv = 4.026069;
	color *= toneMappingExposure;
	color = LINEAR_SRGB_TO_LINEAR_REC2020 * color;
	color = AgXInsetMatrix * color;
	color = max( color, 1e-10 );	color = log2( color );
	color = ( color - AgxMinEv ) / ( AgxMaxEv - AgxMinEv );
	color = clamp( color, 0.0, 1.0 );
	color = agxDefaultContrastApprox( color );
	color = AgXOutsetMatrix * color;
	color = pow( max( vec3( 0.0 ), color ), vec3( 2.2 ) );
	color = LINEAR_REC2020_TO_LINEAR_SRGB * color;
	color = clamp( color, 0.0, 1.0 );
	return color;
}
vec3 NeutralToneMapping( vec3 color ) {
	const float StartCompression = 0.8 - 0.04;
	const float Desaturation = 0.15;
	color *= toneMappingExposure;
	float x = min( color.r, min( color.g, color.b ) );
	float offset = x < 0.08 ? x - 6.25 * x * x : 0.04;
	color -= offset;
	float peak = max( color.r, max( color.g, color.b ) );
	if ( peak < StartCompression ) return color;
	float d = 1. - StartCompression;
	float newPeak = 1. - d * d / ( peak + d - StartCompression );
	color *= newPeak / peak;
	float g = 1. - 1. / ( Desaturation * ( peak - newPeak ) + 1. );
	return mix( color, vec3( newPeak ), g );
}
vec3 CustomToneMapping( vec3 color ) { return color; }`,Zv=`#ifdef USE_TRANSMISSION
	material.transmission = transmission;
	material.transmissionAlpha = 1.0;
	material.thickness = thickness;
	material.attenuationDistance = attenuationDistance;
	material.attenuationColor = attenuationColor;
	#ifdef USE_TRANSMISSIONMAP
		material.transmission *= texture2D( transmissionMap, vTransmissionMapUv ).r;
	#endif
	#ifdef USE_THICKNESSMAP
		material.thickness *= texture2D( thicknessMap, vThicknessMapUv ).g;
	#endif
	vec3 pos = vWorldPosition;
	vec3 v = normalize( cameraPosition - pos );
	vec3 n = transformNormalByInverseViewMatrix( normal, viewMatrix );
	vec4 transmitted = getIBLVolumeRefraction(
		n, v, material.roughness, material.diffuseContribution, material.specularColorBlended, material.specularF90,
		pos, modelMatrix, viewMatrix, projectionMatrix, material.dispersion, material.ior, material.thickness,
		material.attenuationColor, material.attenuationDistance );
	material.transmissionAlpha = mix( material.transmissionAlpha, transmitted.a, material.transmission );
	totalDiffuse = mix( totalDiffuse, transmitted.rgb, material.transmission );
#endif`,Jv=`#ifdef USE_TRANSMISSION
	uniform float transmission;
	uniform float thickness;
	uniform float attenuationDistance;
	uniform vec3 attenuationColor;
	#ifdef USE_TRANSMISSIONMAP
		uniform sampler2D transmissionMap;
	#endif
	#ifdef USE_THICKNESSMAP
		uniform sampler2D thicknessMap;
	#endif
	uniform vec2 transmissionSamplerSize;
	uniform sampler2D transmissionSamplerMap;
	uniform mat4 modelMatrix;
	uniform mat4 projectionMatrix;
	varying vec3 vWorldPosition;
	float w0( float a ) {
		return ( 1.0 / 6.0 ) * ( a * ( a * ( - a + 3.0 ) - 3.0 ) + 1.0 );
	}
	float w1( float a ) {
		return ( 1.0 / 6.0 ) * ( a *  a * ( 3.0 * a - 6.0 ) + 4.0 );
	}
	float w2( float a ){
		return ( 1.0 / 6.0 ) * ( a * ( a * ( - 3.0 * a + 3.0 ) + 3.0 ) + 1.0 );
	}
	float w3( float a ) {
		return ( 1.0 / 6.0 ) * ( a * a * a );
	}
	float g0( float a ) {
		return w0( a ) + w1( a );
	}
	float g1( float a ) {
		return w2( a ) + w3( a );
	}
	float h0( float a ) {
		return - 1.0 + w1( a ) / ( w0( a ) + w1( a ) );
	}
	float h1( float a ) {
		return 1.0 + w3( a ) / ( w2( a ) + w3( a ) );
	}
	vec4 bicubic( sampler2D tex, vec2 uv, vec4 texelSize, float lod ) {
		uv = uv * texelSize.zw + 0.5;
		vec2 iuv = floor( uv );
		vec2 fuv = fract( uv );
		float g0x = g0( fuv.x );
		float g1x = g1( fuv.x );
		float h0x = h0( fuv.x );
		float h1x = h1( fuv.x );
		float h0y = h0( fuv.y );
		float h1y = h1( fuv.y );
		vec2 p0 = ( vec2( iuv.x + h0x, iuv.y + h0y ) - 0.5 ) * texelSize.xy;
		vec2 p1 = ( vec2( iuv.x + h1x, iuv.y + h0y ) - 0.5 ) * texelSize.xy;
		vec2 p2 = ( vec2( iuv.x + h0x, iuv.y + h1y ) - 0.5 ) * texelSize.xy;
		vec2 p3 = ( vec2( iuv.x + h1x, iuv.y + h1y ) - 0.5 ) * texelSize.xy;
		return g0( fuv.y ) * ( g0x * textureLod( tex, p0, lod ) + g1x * textureLod( tex, p1, lod ) ) +
			g1( fuv.y ) * ( g0x * textureLod( tex, p2, lod ) + g1x * textureLod( tex, p3, lod ) );
	}
	vec4 textureBicubic( sampler2D sampler, vec2 uv, float lod ) {
		vec2 fLodSize = vec2( textureSize( sampler, int( lod ) ) );
		vec2 cLodSize = vec2( textureSize( sampler, int( lod + 1.0 ) ) );
		vec2 fLodSizeInv = 1.0 / fLodSize;
		vec2 cLodSizeInv = 1.0 / cLodSize;
		vec4 fSample = bicubic( sampler, uv, vec4( fLodSizeInv, fLodSize ), floor( lod ) );
		vec4 cSample = bicubic( sampler, uv, vec4( cLodSizeInv, cLodSize ), ceil( lod ) );
		return mix( fSample, cSample, fract( lod ) );
	}
	vec3 getVolumeTransmissionRay( const in vec3 n, const in vec3 v, const in float thickness, const in float ior, const in mat4 modelMatrix ) {
		vec3 refractionVector = refract( - v, normalize( n ), 1.0 / ior );
		vec3 modelScale;
		modelScale.x = length( vec3( modelMatrix[ 0 ].xyz ) );
		modelScale.y = length( vec3( modelMatrix[ 1 ].xyz ) );
		modelScale.z = length( vec3( modelMatrix[ 2 ].xyz ) );
		return normalize( refractionVector ) * thickness * modelScale;
	}
	float applyIorToRoughness( const in float roughness, const in float ior ) {
		return roughness * clamp( ior * 2.0 - 2.0, 0.0, 1.0 );
	}
	vec4 getTransmissionSample( const in vec2 fragCoord, const in float roughness, const in float ior ) {
		float lod = log2( transmissionSamplerSize.x ) * applyIorToRoughness( roughness, ior );
		return textureBicubic( transmissionSamplerMap, fragCoord.xy, lod );
	}
	vec3 volumeAttenuation( const in float transmissionDistance, const in vec3 attenuationColor, const in float attenuationDistance ) {
		if ( isinf( attenuationDistance ) ) {
			return vec3( 1.0 );
		} else {
			vec3 attenuationCoefficient = -log( attenuationColor ) / attenuationDistance;
			vec3 transmittance = exp( - attenuationCoefficient * transmissionDistance );			return transmittance;
		}
	}
	vec4 getIBLVolumeRefraction( const in vec3 n, const in vec3 v, const in float roughness, const in vec3 diffuseColor,
		const in vec3 specularColor, const in float specularF90, const in vec3 position, const in mat4 modelMatrix,
		const in mat4 viewMatrix, const in mat4 projMatrix, const in float dispersion, const in float ior, const in float thickness,
		const in vec3 attenuationColor, const in float attenuationDistance ) {
		vec4 transmittedLight;
		vec3 transmittance;
		#ifdef USE_DISPERSION
			float halfSpread = ( ior - 1.0 ) * 0.025 * dispersion;
			vec3 iors = vec3( ior - halfSpread, ior, ior + halfSpread );
			for ( int i = 0; i < 3; i ++ ) {
				vec3 transmissionRay = getVolumeTransmissionRay( n, v, thickness, iors[ i ], modelMatrix );
				vec3 refractedRayExit = position + transmissionRay;
				vec4 ndcPos = projMatrix * viewMatrix * vec4( refractedRayExit, 1.0 );
				vec2 refractionCoords = ndcPos.xy / ndcPos.w;
				refractionCoords += 1.0;
				refractionCoords /= 2.0;
				vec4 transmissionSample = getTransmissionSample( refractionCoords, roughness, iors[ i ] );
				transmittedLight[ i ] = transmissionSample[ i ];
				transmittedLight.a += transmissionSample.a;
				transmittance[ i ] = diffuseColor[ i ] * volumeAttenuation( length( transmissionRay ), attenuationColor, attenuationDistance )[ i ];
			}
			transmittedLight.a /= 3.0;
		#else
			vec3 transmissionRay = getVolumeTransmissionRay( n, v, thickness, ior, modelMatrix );
			vec3 refractedRayExit = position + transmissionRay;
			vec4 ndcPos = projMatrix * viewMatrix * vec4( refractedRayExit, 1.0 );
			vec2 refractionCoords = ndcPos.xy / ndcPos.w;
			refractionCoords += 1.0;
			refractionCoords /= 2.0;
			transmittedLight = getTransmissionSample( refractionCoords, roughness, ior );
			transmittance = diffuseColor * volumeAttenuation( length( transmissionRay ), attenuationColor, attenuationDistance );
		#endif
		vec3 attenuatedColor = transmittance * transmittedLight.rgb;
		vec3 F = EnvironmentBRDF( n, v, specularColor, specularF90, roughness );
		float transmittanceFactor = ( transmittance.r + transmittance.g + transmittance.b ) / 3.0;
		return vec4( ( 1.0 - F ) * attenuatedColor, 1.0 - ( 1.0 - transmittedLight.a ) * transmittanceFactor );
	}
#endif`,jv=`#if defined( USE_UV ) || defined( USE_ANISOTROPY )
	varying vec2 vUv;
#endif
#ifdef USE_MAP
	varying vec2 vMapUv;
#endif
#ifdef USE_ALPHAMAP
	varying vec2 vAlphaMapUv;
#endif
#ifdef USE_LIGHTMAP
	varying vec2 vLightMapUv;
#endif
#ifdef USE_AOMAP
	varying vec2 vAoMapUv;
#endif
#ifdef USE_BUMPMAP
	varying vec2 vBumpMapUv;
#endif
#ifdef USE_NORMALMAP
	varying vec2 vNormalMapUv;
#endif
#ifdef USE_EMISSIVEMAP
	varying vec2 vEmissiveMapUv;
#endif
#ifdef USE_METALNESSMAP
	varying vec2 vMetalnessMapUv;
#endif
#ifdef USE_ROUGHNESSMAP
	varying vec2 vRoughnessMapUv;
#endif
#ifdef USE_DIFFUSE_ROUGHNESSMAP
	varying vec2 vDiffuseRoughnessMapUv;
#endif
#ifdef USE_ANISOTROPYMAP
	varying vec2 vAnisotropyMapUv;
#endif
#ifdef USE_CLEARCOATMAP
	varying vec2 vClearcoatMapUv;
#endif
#ifdef USE_CLEARCOAT_NORMALMAP
	varying vec2 vClearcoatNormalMapUv;
#endif
#ifdef USE_CLEARCOAT_ROUGHNESSMAP
	varying vec2 vClearcoatRoughnessMapUv;
#endif
#ifdef USE_IRIDESCENCEMAP
	varying vec2 vIridescenceMapUv;
#endif
#ifdef USE_IRIDESCENCE_THICKNESSMAP
	varying vec2 vIridescenceThicknessMapUv;
#endif
#ifdef USE_SHEEN_COLORMAP
	varying vec2 vSheenColorMapUv;
#endif
#ifdef USE_SHEEN_ROUGHNESSMAP
	varying vec2 vSheenRoughnessMapUv;
#endif
#ifdef USE_SPECULARMAP
	varying vec2 vSpecularMapUv;
#endif
#ifdef USE_SPECULAR_COLORMAP
	varying vec2 vSpecularColorMapUv;
#endif
#ifdef USE_SPECULAR_INTENSITYMAP
	varying vec2 vSpecularIntensityMapUv;
#endif
#ifdef USE_TRANSMISSIONMAP
	uniform mat3 transmissionMapTransform;
	varying vec2 vTransmissionMapUv;
#endif
#ifdef USE_THICKNESSMAP
	uniform mat3 thicknessMapTransform;
	varying vec2 vThicknessMapUv;
#endif`,Qv=`#if defined( USE_UV ) || defined( USE_ANISOTROPY )
	varying vec2 vUv;
#endif
#ifdef USE_MAP
	uniform mat3 mapTransform;
	varying vec2 vMapUv;
#endif
#ifdef USE_ALPHAMAP
	uniform mat3 alphaMapTransform;
	varying vec2 vAlphaMapUv;
#endif
#ifdef USE_LIGHTMAP
	uniform mat3 lightMapTransform;
	varying vec2 vLightMapUv;
#endif
#ifdef USE_AOMAP
	uniform mat3 aoMapTransform;
	varying vec2 vAoMapUv;
#endif
#ifdef USE_BUMPMAP
	uniform mat3 bumpMapTransform;
	varying vec2 vBumpMapUv;
#endif
#ifdef USE_NORMALMAP
	uniform mat3 normalMapTransform;
	varying vec2 vNormalMapUv;
#endif
#ifdef USE_DISPLACEMENTMAP
	uniform mat3 displacementMapTransform;
	varying vec2 vDisplacementMapUv;
#endif
#ifdef USE_EMISSIVEMAP
	uniform mat3 emissiveMapTransform;
	varying vec2 vEmissiveMapUv;
#endif
#ifdef USE_METALNESSMAP
	uniform mat3 metalnessMapTransform;
	varying vec2 vMetalnessMapUv;
#endif
#ifdef USE_ROUGHNESSMAP
	uniform mat3 roughnessMapTransform;
	varying vec2 vRoughnessMapUv;
#endif
#ifdef USE_DIFFUSE_ROUGHNESSMAP
	uniform mat3 diffuseRoughnessMapTransform;
	varying vec2 vDiffuseRoughnessMapUv;
#endif
#ifdef USE_ANISOTROPYMAP
	uniform mat3 anisotropyMapTransform;
	varying vec2 vAnisotropyMapUv;
#endif
#ifdef USE_CLEARCOATMAP
	uniform mat3 clearcoatMapTransform;
	varying vec2 vClearcoatMapUv;
#endif
#ifdef USE_CLEARCOAT_NORMALMAP
	uniform mat3 clearcoatNormalMapTransform;
	varying vec2 vClearcoatNormalMapUv;
#endif
#ifdef USE_CLEARCOAT_ROUGHNESSMAP
	uniform mat3 clearcoatRoughnessMapTransform;
	varying vec2 vClearcoatRoughnessMapUv;
#endif
#ifdef USE_SHEEN_COLORMAP
	uniform mat3 sheenColorMapTransform;
	varying vec2 vSheenColorMapUv;
#endif
#ifdef USE_SHEEN_ROUGHNESSMAP
	uniform mat3 sheenRoughnessMapTransform;
	varying vec2 vSheenRoughnessMapUv;
#endif
#ifdef USE_IRIDESCENCEMAP
	uniform mat3 iridescenceMapTransform;
	varying vec2 vIridescenceMapUv;
#endif
#ifdef USE_IRIDESCENCE_THICKNESSMAP
	uniform mat3 iridescenceThicknessMapTransform;
	varying vec2 vIridescenceThicknessMapUv;
#endif
#ifdef USE_SPECULARMAP
	uniform mat3 specularMapTransform;
	varying vec2 vSpecularMapUv;
#endif
#ifdef USE_SPECULAR_COLORMAP
	uniform mat3 specularColorMapTransform;
	varying vec2 vSpecularColorMapUv;
#endif
#ifdef USE_SPECULAR_INTENSITYMAP
	uniform mat3 specularIntensityMapTransform;
	varying vec2 vSpecularIntensityMapUv;
#endif
#ifdef USE_TRANSMISSIONMAP
	uniform mat3 transmissionMapTransform;
	varying vec2 vTransmissionMapUv;
#endif
#ifdef USE_THICKNESSMAP
	uniform mat3 thicknessMapTransform;
	varying vec2 vThicknessMapUv;
#endif`,tS=`#if defined( USE_UV ) || defined( USE_ANISOTROPY )
	vUv = vec3( uv, 1 ).xy;
#endif
#ifdef USE_MAP
	vMapUv = ( mapTransform * vec3( MAP_UV, 1 ) ).xy;
#endif
#ifdef USE_ALPHAMAP
	vAlphaMapUv = ( alphaMapTransform * vec3( ALPHAMAP_UV, 1 ) ).xy;
#endif
#ifdef USE_LIGHTMAP
	vLightMapUv = ( lightMapTransform * vec3( LIGHTMAP_UV, 1 ) ).xy;
#endif
#ifdef USE_AOMAP
	vAoMapUv = ( aoMapTransform * vec3( AOMAP_UV, 1 ) ).xy;
#endif
#ifdef USE_BUMPMAP
	vBumpMapUv = ( bumpMapTransform * vec3( BUMPMAP_UV, 1 ) ).xy;
#endif
#ifdef USE_NORMALMAP
	vNormalMapUv = ( normalMapTransform * vec3( NORMALMAP_UV, 1 ) ).xy;
#endif
#ifdef USE_DISPLACEMENTMAP
	vDisplacementMapUv = ( displacementMapTransform * vec3( DISPLACEMENTMAP_UV, 1 ) ).xy;
#endif
#ifdef USE_EMISSIVEMAP
	vEmissiveMapUv = ( emissiveMapTransform * vec3( EMISSIVEMAP_UV, 1 ) ).xy;
#endif
#ifdef USE_METALNESSMAP
	vMetalnessMapUv = ( metalnessMapTransform * vec3( METALNESSMAP_UV, 1 ) ).xy;
#endif
#ifdef USE_ROUGHNESSMAP
	vRoughnessMapUv = ( roughnessMapTransform * vec3( ROUGHNESSMAP_UV, 1 ) ).xy;
#endif
#ifdef USE_DIFFUSE_ROUGHNESSMAP
	vDiffuseRoughnessMapUv = ( diffuseRoughnessMapTransform * vec3( DIFFUSE_ROUGHNESSMAP_UV, 1 ) ).xy;
#endif
#ifdef USE_ANISOTROPYMAP
	vAnisotropyMapUv = ( anisotropyMapTransform * vec3( ANISOTROPYMAP_UV, 1 ) ).xy;
#endif
#ifdef USE_CLEARCOATMAP
	vClearcoatMapUv = ( clearcoatMapTransform * vec3( CLEARCOATMAP_UV, 1 ) ).xy;
#endif
#ifdef USE_CLEARCOAT_NORMALMAP
	vClearcoatNormalMapUv = ( clearcoatNormalMapTransform * vec3( CLEARCOAT_NORMALMAP_UV, 1 ) ).xy;
#endif
#ifdef USE_CLEARCOAT_ROUGHNESSMAP
	vClearcoatRoughnessMapUv = ( clearcoatRoughnessMapTransform * vec3( CLEARCOAT_ROUGHNESSMAP_UV, 1 ) ).xy;
#endif
#ifdef USE_IRIDESCENCEMAP
	vIridescenceMapUv = ( iridescenceMapTransform * vec3( IRIDESCENCEMAP_UV, 1 ) ).xy;
#endif
#ifdef USE_IRIDESCENCE_THICKNESSMAP
	vIridescenceThicknessMapUv = ( iridescenceThicknessMapTransform * vec3( IRIDESCENCE_THICKNESSMAP_UV, 1 ) ).xy;
#endif
#ifdef USE_SHEEN_COLORMAP
	vSheenColorMapUv = ( sheenColorMapTransform * vec3( SHEEN_COLORMAP_UV, 1 ) ).xy;
#endif
#ifdef USE_SHEEN_ROUGHNESSMAP
	vSheenRoughnessMapUv = ( sheenRoughnessMapTransform * vec3( SHEEN_ROUGHNESSMAP_UV, 1 ) ).xy;
#endif
#ifdef USE_SPECULARMAP
	vSpecularMapUv = ( specularMapTransform * vec3( SPECULARMAP_UV, 1 ) ).xy;
#endif
#ifdef USE_SPECULAR_COLORMAP
	vSpecularColorMapUv = ( specularColorMapTransform * vec3( SPECULAR_COLORMAP_UV, 1 ) ).xy;
#endif
#ifdef USE_SPECULAR_INTENSITYMAP
	vSpecularIntensityMapUv = ( specularIntensityMapTransform * vec3( SPECULAR_INTENSITYMAP_UV, 1 ) ).xy;
#endif
#ifdef USE_TRANSMISSIONMAP
	vTransmissionMapUv = ( transmissionMapTransform * vec3( TRANSMISSIONMAP_UV, 1 ) ).xy;
#endif
#ifdef USE_THICKNESSMAP
	vThicknessMapUv = ( thicknessMapTransform * vec3( THICKNESSMAP_UV, 1 ) ).xy;
#endif`,eS=`#if defined( USE_ENVMAP ) || defined( DISTANCE ) || defined ( USE_SHADOWMAP ) || defined ( USE_TRANSMISSION ) || NUM_SPOT_LIGHT_COORDS > 0
	vec4 worldPosition = vec4( transformed, 1.0 );
	#ifdef USE_BATCHING
		worldPosition = batchingMatrix * worldPosition;
	#endif
	#ifdef USE_INSTANCING
		worldPosition = instanceMatrix * worldPosition;
	#endif
	worldPosition = modelMatrix * worldPosition;
#endif`,nS=`varying vec2 vUv;
uniform mat3 uvTransform;
void main() {
	vUv = ( uvTransform * vec3( uv, 1 ) ).xy;
	gl_Position = vec4( position.xy, 1.0, 1.0 );
}`,iS=`uniform sampler2D t2D;
uniform float backgroundIntensity;
varying vec2 vUv;
void main() {
	vec4 texColor = texture2D( t2D, vUv );
	#ifdef DECODE_VIDEO_TEXTURE
		texColor = vec4( mix( pow( texColor.rgb * 0.9478672986 + vec3( 0.0521327014 ), vec3( 2.4 ) ), texColor.rgb * 0.0773993808, vec3( lessThanEqual( texColor.rgb, vec3( 0.04045 ) ) ) ), texColor.w );
	#endif
	texColor.rgb *= backgroundIntensity;
	gl_FragColor = texColor;
	#include <tonemapping_fragment>
	#include <colorspace_fragment>
}`,sS=`varying vec3 vWorldDirection;
#include <common>
void main() {
	vWorldDirection = transformDirection( position, modelMatrix );
	#include <begin_vertex>
	#include <project_vertex>
	gl_Position.z = gl_Position.w;
}`,rS=`uniform float backgroundBlurriness;
uniform float backgroundIntensity;
uniform mat3 backgroundRotation;
varying vec3 vWorldDirection;
#include <envmap_common_pars_fragment>
void main() {
	#ifdef ENVMAP_TYPE_PMREM
		vec4 texColor = textureLod( envMap, backgroundRotation * vWorldDirection, roughnessToMip( backgroundBlurriness ) );
	#else
		vec4 texColor = textureCube( envMap, backgroundRotation * vWorldDirection );
	#endif
	texColor.rgb *= backgroundIntensity;
	gl_FragColor = texColor;
	#include <tonemapping_fragment>
	#include <colorspace_fragment>
}`,oS=`varying vec3 vWorldDirection;
#include <common>
void main() {
	vWorldDirection = transformDirection( position, modelMatrix );
	#include <begin_vertex>
	#include <project_vertex>
	gl_Position.z = gl_Position.w;
}`,aS=`uniform samplerCube tCube;
uniform float tFlip;
uniform float opacity;
varying vec3 vWorldDirection;
void main() {
	vec4 texColor = textureCube( tCube, vec3( tFlip * vWorldDirection.x, vWorldDirection.yz ) );
	gl_FragColor = texColor;
	gl_FragColor.a *= opacity;
	#include <tonemapping_fragment>
	#include <colorspace_fragment>
}`,lS=`#include <common>
#include <batching_pars_vertex>
#include <uv_pars_vertex>
#include <displacementmap_pars_vertex>
#include <morphtarget_pars_vertex>
#include <skinning_pars_vertex>
#include <logdepthbuf_pars_vertex>
#include <clipping_planes_pars_vertex>
varying vec2 vHighPrecisionZW;
void main() {
	#include <uv_vertex>
	#include <batching_vertex>
	#include <skinbase_vertex>
	#include <morphinstance_vertex>
	#ifdef USE_DISPLACEMENTMAP
		#include <beginnormal_vertex>
		#include <morphnormal_vertex>
		#include <skinnormal_vertex>
	#endif
	#include <begin_vertex>
	#include <morphtarget_vertex>
	#include <skinning_vertex>
	#include <displacementmap_vertex>
	#include <project_vertex>
	#include <logdepthbuf_vertex>
	#include <clipping_planes_vertex>
	vHighPrecisionZW = gl_Position.zw;
}`,cS=`#if DEPTH_PACKING == 3200
	uniform float opacity;
#endif
#include <common>
#include <packing>
#include <uv_pars_fragment>
#include <map_pars_fragment>
#include <alphamap_pars_fragment>
#include <alphatest_pars_fragment>
#include <alphahash_pars_fragment>
#include <logdepthbuf_pars_fragment>
#include <clipping_planes_pars_fragment>
varying vec2 vHighPrecisionZW;
void main() {
	vec4 diffuseColor = vec4( 1.0 );
	#include <clipping_planes_fragment>
	#if DEPTH_PACKING == 3200
		diffuseColor.a = opacity;
	#endif
	#include <map_fragment>
	#include <alphamap_fragment>
	#include <alphatest_fragment>
	#include <alphahash_fragment>
	#include <logdepthbuf_fragment>
	#ifdef USE_REVERSED_DEPTH_BUFFER
		float fragCoordZ = vHighPrecisionZW[ 0 ] / vHighPrecisionZW[ 1 ];
	#else
		float fragCoordZ = 0.5 * vHighPrecisionZW[ 0 ] / vHighPrecisionZW[ 1 ] + 0.5;
	#endif
	#if DEPTH_PACKING == 3200
		gl_FragColor = vec4( vec3( 1.0 - fragCoordZ ), opacity );
	#elif DEPTH_PACKING == 3201
		gl_FragColor = packDepthToRGBA( fragCoordZ );
	#elif DEPTH_PACKING == 3202
		gl_FragColor = vec4( packDepthToRGB( fragCoordZ ), 1.0 );
	#elif DEPTH_PACKING == 3203
		gl_FragColor = vec4( packDepthToRG( fragCoordZ ), 0.0, 1.0 );
	#endif
}`,hS=`#define DISTANCE
varying vec3 vWorldPosition;
#include <common>
#include <batching_pars_vertex>
#include <uv_pars_vertex>
#include <displacementmap_pars_vertex>
#include <morphtarget_pars_vertex>
#include <skinning_pars_vertex>
#include <clipping_planes_pars_vertex>
void main() {
	#include <uv_vertex>
	#include <batching_vertex>
	#include <skinbase_vertex>
	#include <morphinstance_vertex>
	#ifdef USE_DISPLACEMENTMAP
		#include <beginnormal_vertex>
		#include <morphnormal_vertex>
		#include <skinnormal_vertex>
	#endif
	#include <begin_vertex>
	#include <morphtarget_vertex>
	#include <skinning_vertex>
	#include <displacementmap_vertex>
	#include <project_vertex>
	#include <worldpos_vertex>
	#include <clipping_planes_vertex>
	vWorldPosition = worldPosition.xyz;
}`,uS=`#define DISTANCE
uniform vec3 referencePosition;
uniform float nearDistance;
uniform float farDistance;
varying vec3 vWorldPosition;
#include <common>
#include <uv_pars_fragment>
#include <map_pars_fragment>
#include <alphamap_pars_fragment>
#include <alphatest_pars_fragment>
#include <alphahash_pars_fragment>
#include <clipping_planes_pars_fragment>
void main() {
	vec4 diffuseColor = vec4( 1.0 );
	#include <clipping_planes_fragment>
	#include <map_fragment>
	#include <alphamap_fragment>
	#include <alphatest_fragment>
	#include <alphahash_fragment>
	float dist = length( vWorldPosition - referencePosition );
	dist = ( dist - nearDistance ) / ( farDistance - nearDistance );
	dist = saturate( dist );
	gl_FragColor = vec4( dist, 0.0, 0.0, 1.0 );
}`,dS=`varying vec3 vWorldDirection;
#include <common>
void main() {
	vWorldDirection = transformDirection( position, modelMatrix );
	#include <begin_vertex>
	#include <project_vertex>
}`,fS=`uniform sampler2D tEquirect;
varying vec3 vWorldDirection;
#include <common>
void main() {
	vec3 direction = normalize( vWorldDirection );
	vec2 sampleUV = equirectUv( direction );
	gl_FragColor = texture2D( tEquirect, sampleUV );
	#include <tonemapping_fragment>
	#include <colorspace_fragment>
}`,pS=`uniform float scale;
attribute float lineDistance;
varying float vLineDistance;
#include <common>
#include <uv_pars_vertex>
#include <color_pars_vertex>
#include <fog_pars_vertex>
#include <morphtarget_pars_vertex>
#include <logdepthbuf_pars_vertex>
#include <clipping_planes_pars_vertex>
void main() {
	vLineDistance = scale * lineDistance;
	#include <uv_vertex>
	#include <color_vertex>
	#include <morphinstance_vertex>
	#include <morphcolor_vertex>
	#include <begin_vertex>
	#include <morphtarget_vertex>
	#include <project_vertex>
	#include <logdepthbuf_vertex>
	#include <clipping_planes_vertex>
	#include <fog_vertex>
}`,mS=`uniform vec3 diffuse;
uniform float opacity;
uniform float dashSize;
uniform float totalSize;
varying float vLineDistance;
#include <common>
#include <color_pars_fragment>
#include <uv_pars_fragment>
#include <map_pars_fragment>
#include <fog_pars_fragment>
#include <logdepthbuf_pars_fragment>
#include <clipping_planes_pars_fragment>
void main() {
	vec4 diffuseColor = vec4( diffuse, opacity );
	#include <clipping_planes_fragment>
	if ( mod( vLineDistance, totalSize ) > dashSize ) {
		discard;
	}
	vec3 outgoingLight = vec3( 0.0 );
	#include <logdepthbuf_fragment>
	#include <map_fragment>
	#include <color_fragment>
	outgoingLight = diffuseColor.rgb;
	#include <opaque_fragment>
	#include <tonemapping_fragment>
	#include <colorspace_fragment>
	#include <fog_fragment>
	#include <premultiplied_alpha_fragment>
}`,gS=`#include <common>
#include <batching_pars_vertex>
#include <uv_pars_vertex>
#include <envmap_pars_vertex>
#include <color_pars_vertex>
#include <fog_pars_vertex>
#include <morphtarget_pars_vertex>
#include <skinning_pars_vertex>
#include <logdepthbuf_pars_vertex>
#include <clipping_planes_pars_vertex>
void main() {
	#include <uv_vertex>
	#include <color_vertex>
	#include <morphinstance_vertex>
	#include <morphcolor_vertex>
	#include <batching_vertex>
	#if defined ( USE_ENVMAP ) || defined ( USE_SKINNING )
		#include <beginnormal_vertex>
		#include <morphnormal_vertex>
		#include <skinbase_vertex>
		#include <skinnormal_vertex>
		#include <defaultnormal_vertex>
	#endif
	#include <begin_vertex>
	#include <morphtarget_vertex>
	#include <skinning_vertex>
	#include <project_vertex>
	#include <logdepthbuf_vertex>
	#include <clipping_planes_vertex>
	#include <worldpos_vertex>
	#include <envmap_vertex>
	#include <fog_vertex>
}`,_S=`uniform vec3 diffuse;
uniform float opacity;
#ifndef FLAT_SHADED
	varying vec3 vNormal;
#endif
#include <common>
#include <dithering_pars_fragment>
#include <color_pars_fragment>
#include <uv_pars_fragment>
#include <map_pars_fragment>
#include <alphamap_pars_fragment>
#include <alphatest_pars_fragment>
#include <alphahash_pars_fragment>
#include <aomap_pars_fragment>
#include <lightmap_pars_fragment>
#include <envmap_common_pars_fragment>
#include <envmap_pars_fragment>
#include <fog_pars_fragment>
#include <specularmap_pars_fragment>
#include <logdepthbuf_pars_fragment>
#include <clipping_planes_pars_fragment>
void main() {
	vec4 diffuseColor = vec4( diffuse, opacity );
	#include <clipping_planes_fragment>
	#include <logdepthbuf_fragment>
	#include <map_fragment>
	#include <color_fragment>
	#include <alphamap_fragment>
	#include <alphatest_fragment>
	#include <alphahash_fragment>
	#include <specularmap_fragment>
	ReflectedLight reflectedLight = ReflectedLight( vec3( 0.0 ), vec3( 0.0 ), vec3( 0.0 ), vec3( 0.0 ) );
	#ifdef USE_LIGHTMAP
		vec4 lightMapTexel = texture2D( lightMap, vLightMapUv );
		reflectedLight.indirectDiffuse += lightMapTexel.rgb * lightMapIntensity * RECIPROCAL_PI;
	#else
		reflectedLight.indirectDiffuse += vec3( 1.0 );
	#endif
	#include <aomap_fragment>
	reflectedLight.indirectDiffuse *= diffuseColor.rgb;
	vec3 outgoingLight = reflectedLight.indirectDiffuse;
	#include <envmap_fragment>
	#include <opaque_fragment>
	#include <tonemapping_fragment>
	#include <colorspace_fragment>
	#include <fog_fragment>
	#include <premultiplied_alpha_fragment>
	#include <dithering_fragment>
}`,xS=`#define LAMBERT
varying vec3 vViewPosition;
#include <common>
#include <batching_pars_vertex>
#include <uv_pars_vertex>
#include <displacementmap_pars_vertex>
#include <envmap_pars_vertex>
#include <color_pars_vertex>
#include <fog_pars_vertex>
#include <normal_pars_vertex>
#include <morphtarget_pars_vertex>
#include <skinning_pars_vertex>
#include <shadowmap_pars_vertex>
#include <logdepthbuf_pars_vertex>
#include <clipping_planes_pars_vertex>
void main() {
	#include <uv_vertex>
	#include <color_vertex>
	#include <morphinstance_vertex>
	#include <morphcolor_vertex>
	#include <batching_vertex>
	#include <beginnormal_vertex>
	#include <morphnormal_vertex>
	#include <skinbase_vertex>
	#include <skinnormal_vertex>
	#include <defaultnormal_vertex>
	#include <normal_vertex>
	#include <begin_vertex>
	#include <morphtarget_vertex>
	#include <skinning_vertex>
	#include <displacementmap_vertex>
	#include <project_vertex>
	#include <logdepthbuf_vertex>
	#include <clipping_planes_vertex>
	vViewPosition = - mvPosition.xyz;
	#include <worldpos_vertex>
	#include <envmap_vertex>
	#include <shadowmap_vertex>
	#include <fog_vertex>
}`,yS=`#define LAMBERT
uniform vec3 diffuse;
uniform vec3 emissive;
uniform float opacity;
#include <common>
#include <dithering_pars_fragment>
#include <color_pars_fragment>
#include <uv_pars_fragment>
#include <map_pars_fragment>
#include <alphamap_pars_fragment>
#include <alphatest_pars_fragment>
#include <alphahash_pars_fragment>
#include <aomap_pars_fragment>
#include <lightmap_pars_fragment>
#include <emissivemap_pars_fragment>
#include <envmap_common_pars_fragment>
#include <envmap_pars_fragment>
#include <envmap_physical_pars_fragment>
#include <fog_pars_fragment>
#include <bsdfs>
#include <lights_pars_begin>
#include <normal_pars_fragment>
#include <lights_lambert_pars_fragment>
#include <shadowmap_pars_fragment>
#include <bumpmap_pars_fragment>
#include <normalmap_pars_fragment>
#include <specularmap_pars_fragment>
#include <logdepthbuf_pars_fragment>
#include <clipping_planes_pars_fragment>
void main() {
	vec4 diffuseColor = vec4( diffuse, opacity );
	#include <clipping_planes_fragment>
	ReflectedLight reflectedLight = ReflectedLight( vec3( 0.0 ), vec3( 0.0 ), vec3( 0.0 ), vec3( 0.0 ) );
	vec3 totalEmissiveRadiance = emissive;
	#include <logdepthbuf_fragment>
	#include <map_fragment>
	#include <color_fragment>
	#include <alphamap_fragment>
	#include <alphatest_fragment>
	#include <alphahash_fragment>
	#include <specularmap_fragment>
	#include <normal_fragment_begin>
	#include <normal_fragment_maps>
	#include <emissivemap_fragment>
	#include <lights_lambert_fragment>
	#include <lights_fragment_begin>
	#include <lights_fragment_maps>
	#include <lights_fragment_end>
	#include <aomap_fragment>
	vec3 outgoingLight = reflectedLight.directDiffuse + reflectedLight.indirectDiffuse + totalEmissiveRadiance;
	#include <envmap_fragment>
	#include <opaque_fragment>
	#include <tonemapping_fragment>
	#include <colorspace_fragment>
	#include <fog_fragment>
	#include <premultiplied_alpha_fragment>
	#include <dithering_fragment>
}`,vS=`#define MATCAP
varying vec3 vViewPosition;
#include <common>
#include <batching_pars_vertex>
#include <uv_pars_vertex>
#include <color_pars_vertex>
#include <displacementmap_pars_vertex>
#include <fog_pars_vertex>
#include <normal_pars_vertex>
#include <morphtarget_pars_vertex>
#include <skinning_pars_vertex>
#include <logdepthbuf_pars_vertex>
#include <clipping_planes_pars_vertex>
void main() {
	#include <uv_vertex>
	#include <color_vertex>
	#include <morphinstance_vertex>
	#include <morphcolor_vertex>
	#include <batching_vertex>
	#include <beginnormal_vertex>
	#include <morphnormal_vertex>
	#include <skinbase_vertex>
	#include <skinnormal_vertex>
	#include <defaultnormal_vertex>
	#include <normal_vertex>
	#include <begin_vertex>
	#include <morphtarget_vertex>
	#include <skinning_vertex>
	#include <displacementmap_vertex>
	#include <project_vertex>
	#include <logdepthbuf_vertex>
	#include <clipping_planes_vertex>
	#include <fog_vertex>
	vViewPosition = - mvPosition.xyz;
}`,SS=`#define MATCAP
uniform vec3 diffuse;
uniform float opacity;
uniform sampler2D matcap;
varying vec3 vViewPosition;
#include <common>
#include <dithering_pars_fragment>
#include <color_pars_fragment>
#include <uv_pars_fragment>
#include <map_pars_fragment>
#include <alphamap_pars_fragment>
#include <alphatest_pars_fragment>
#include <alphahash_pars_fragment>
#include <fog_pars_fragment>
#include <normal_pars_fragment>
#include <bumpmap_pars_fragment>
#include <normalmap_pars_fragment>
#include <logdepthbuf_pars_fragment>
#include <clipping_planes_pars_fragment>
void main() {
	vec4 diffuseColor = vec4( diffuse, opacity );
	#include <clipping_planes_fragment>
	#include <logdepthbuf_fragment>
	#include <map_fragment>
	#include <color_fragment>
	#include <alphamap_fragment>
	#include <alphatest_fragment>
	#include <alphahash_fragment>
	#include <normal_fragment_begin>
	#include <normal_fragment_maps>
	vec3 viewDir = normalize( vViewPosition );
	vec3 x = normalize( vec3( viewDir.z, 0.0, - viewDir.x ) );
	vec3 y = cross( viewDir, x );
	vec2 uv = vec2( dot( x, normal ), dot( y, normal ) ) * 0.495 + 0.5;
	#ifdef USE_MATCAP
		vec4 matcapColor = texture2D( matcap, uv );
	#else
		vec4 matcapColor = vec4( vec3( mix( 0.2, 0.8, uv.y ) ), 1.0 );
	#endif
	vec3 outgoingLight = diffuseColor.rgb * matcapColor.rgb;
	#include <opaque_fragment>
	#include <tonemapping_fragment>
	#include <colorspace_fragment>
	#include <fog_fragment>
	#include <premultiplied_alpha_fragment>
	#include <dithering_fragment>
}`,bS=`#define NORMAL
#if defined( FLAT_SHADED ) || defined( USE_BUMPMAP ) || defined( USE_NORMALMAP_TANGENTSPACE )
	varying vec3 vViewPosition;
#endif
#include <common>
#include <batching_pars_vertex>
#include <uv_pars_vertex>
#include <displacementmap_pars_vertex>
#include <normal_pars_vertex>
#include <morphtarget_pars_vertex>
#include <skinning_pars_vertex>
#include <logdepthbuf_pars_vertex>
#include <clipping_planes_pars_vertex>
void main() {
	#include <uv_vertex>
	#include <batching_vertex>
	#include <beginnormal_vertex>
	#include <morphinstance_vertex>
	#include <morphnormal_vertex>
	#include <skinbase_vertex>
	#include <skinnormal_vertex>
	#include <defaultnormal_vertex>
	#include <normal_vertex>
	#include <begin_vertex>
	#include <morphtarget_vertex>
	#include <skinning_vertex>
	#include <displacementmap_vertex>
	#include <project_vertex>
	#include <logdepthbuf_vertex>
	#include <clipping_planes_vertex>
#if defined( FLAT_SHADED ) || defined( USE_BUMPMAP ) || defined( USE_NORMALMAP_TANGENTSPACE )
	vViewPosition = - mvPosition.xyz;
#endif
}`,MS=`#define NORMAL
uniform float opacity;
#if defined( FLAT_SHADED ) || defined( USE_BUMPMAP ) || defined( USE_NORMALMAP_TANGENTSPACE )
	varying vec3 vViewPosition;
#endif
#include <uv_pars_fragment>
#include <normal_pars_fragment>
#include <bumpmap_pars_fragment>
#include <normalmap_pars_fragment>
#include <logdepthbuf_pars_fragment>
#include <clipping_planes_pars_fragment>
void main() {
	vec4 diffuseColor = vec4( 0.0, 0.0, 0.0, opacity );
	#include <clipping_planes_fragment>
	#include <logdepthbuf_fragment>
	#include <normal_fragment_begin>
	#include <normal_fragment_maps>
	gl_FragColor = vec4( normalize( normal ) * 0.5 + 0.5, diffuseColor.a );
	#ifdef OPAQUE
		gl_FragColor.a = 1.0;
	#endif
}`,wS=`#define PHONG
varying vec3 vViewPosition;
#include <common>
#include <batching_pars_vertex>
#include <uv_pars_vertex>
#include <displacementmap_pars_vertex>
#include <envmap_pars_vertex>
#include <color_pars_vertex>
#include <fog_pars_vertex>
#include <normal_pars_vertex>
#include <morphtarget_pars_vertex>
#include <skinning_pars_vertex>
#include <shadowmap_pars_vertex>
#include <logdepthbuf_pars_vertex>
#include <clipping_planes_pars_vertex>
void main() {
	#include <uv_vertex>
	#include <color_vertex>
	#include <morphcolor_vertex>
	#include <batching_vertex>
	#include <beginnormal_vertex>
	#include <morphinstance_vertex>
	#include <morphnormal_vertex>
	#include <skinbase_vertex>
	#include <skinnormal_vertex>
	#include <defaultnormal_vertex>
	#include <normal_vertex>
	#include <begin_vertex>
	#include <morphtarget_vertex>
	#include <skinning_vertex>
	#include <displacementmap_vertex>
	#include <project_vertex>
	#include <logdepthbuf_vertex>
	#include <clipping_planes_vertex>
	vViewPosition = - mvPosition.xyz;
	#include <worldpos_vertex>
	#include <envmap_vertex>
	#include <shadowmap_vertex>
	#include <fog_vertex>
}`,TS=`#define PHONG
uniform vec3 diffuse;
uniform vec3 emissive;
uniform vec3 specular;
uniform float shininess;
uniform float opacity;
#include <common>
#include <dithering_pars_fragment>
#include <color_pars_fragment>
#include <uv_pars_fragment>
#include <map_pars_fragment>
#include <alphamap_pars_fragment>
#include <alphatest_pars_fragment>
#include <alphahash_pars_fragment>
#include <aomap_pars_fragment>
#include <lightmap_pars_fragment>
#include <emissivemap_pars_fragment>
#include <envmap_common_pars_fragment>
#include <envmap_pars_fragment>
#include <envmap_physical_pars_fragment>
#include <fog_pars_fragment>
#include <bsdfs>
#include <lights_pars_begin>
#include <normal_pars_fragment>
#include <lights_phong_pars_fragment>
#include <shadowmap_pars_fragment>
#include <bumpmap_pars_fragment>
#include <normalmap_pars_fragment>
#include <specularmap_pars_fragment>
#include <logdepthbuf_pars_fragment>
#include <clipping_planes_pars_fragment>
void main() {
	vec4 diffuseColor = vec4( diffuse, opacity );
	#include <clipping_planes_fragment>
	ReflectedLight reflectedLight = ReflectedLight( vec3( 0.0 ), vec3( 0.0 ), vec3( 0.0 ), vec3( 0.0 ) );
	vec3 totalEmissiveRadiance = emissive;
	#include <logdepthbuf_fragment>
	#include <map_fragment>
	#include <color_fragment>
	#include <alphamap_fragment>
	#include <alphatest_fragment>
	#include <alphahash_fragment>
	#include <specularmap_fragment>
	#include <normal_fragment_begin>
	#include <normal_fragment_maps>
	#include <emissivemap_fragment>
	#include <lights_phong_fragment>
	#include <lights_fragment_begin>
	#include <lights_fragment_maps>
	#include <lights_fragment_end>
	#include <aomap_fragment>
	vec3 outgoingLight = reflectedLight.directDiffuse + reflectedLight.indirectDiffuse + reflectedLight.directSpecular + reflectedLight.indirectSpecular + totalEmissiveRadiance;
	#include <envmap_fragment>
	#include <opaque_fragment>
	#include <tonemapping_fragment>
	#include <colorspace_fragment>
	#include <fog_fragment>
	#include <premultiplied_alpha_fragment>
	#include <dithering_fragment>
}`,AS=`#define STANDARD
varying vec3 vViewPosition;
#ifdef USE_TRANSMISSION
	varying vec3 vWorldPosition;
#endif
#include <common>
#include <batching_pars_vertex>
#include <uv_pars_vertex>
#include <displacementmap_pars_vertex>
#include <color_pars_vertex>
#include <fog_pars_vertex>
#include <normal_pars_vertex>
#include <morphtarget_pars_vertex>
#include <skinning_pars_vertex>
#include <shadowmap_pars_vertex>
#include <logdepthbuf_pars_vertex>
#include <clipping_planes_pars_vertex>
void main() {
	#include <uv_vertex>
	#include <color_vertex>
	#include <morphinstance_vertex>
	#include <morphcolor_vertex>
	#include <batching_vertex>
	#include <beginnormal_vertex>
	#include <morphnormal_vertex>
	#include <skinbase_vertex>
	#include <skinnormal_vertex>
	#include <defaultnormal_vertex>
	#include <normal_vertex>
	#include <begin_vertex>
	#include <morphtarget_vertex>
	#include <skinning_vertex>
	#include <displacementmap_vertex>
	#include <project_vertex>
	#include <logdepthbuf_vertex>
	#include <clipping_planes_vertex>
	vViewPosition = - mvPosition.xyz;
	#include <worldpos_vertex>
	#include <shadowmap_vertex>
	#include <fog_vertex>
#ifdef USE_TRANSMISSION
	vWorldPosition = worldPosition.xyz;
#endif
}`,ES=`#define STANDARD
#ifdef PHYSICAL
	#define IOR
	#define USE_SPECULAR
#endif
uniform vec3 diffuse;
uniform vec3 emissive;
uniform float roughness;
uniform float metalness;
uniform float opacity;
#ifdef IOR
	uniform float ior;
#endif
#ifdef USE_SPECULAR
	uniform float specularIntensity;
	uniform vec3 specularColor;
	#ifdef USE_SPECULAR_COLORMAP
		uniform sampler2D specularColorMap;
	#endif
	#ifdef USE_SPECULAR_INTENSITYMAP
		uniform sampler2D specularIntensityMap;
	#endif
#endif
#ifdef USE_CLEARCOAT
	uniform float clearcoat;
	uniform float clearcoatRoughness;
#endif
#ifdef USE_DIFFUSE_ROUGHNESS
	uniform float diffuseRoughness;
	#ifdef USE_DIFFUSE_ROUGHNESSMAP
		uniform sampler2D diffuseRoughnessMap;
	#endif
#endif
#ifdef USE_DISPERSION
	uniform float dispersion;
#endif
#ifdef USE_RETROREFLECTION
	uniform float retroreflectivity;
#endif
#ifdef USE_IRIDESCENCE
	uniform float iridescence;
	uniform float iridescenceIOR;
	uniform float iridescenceThicknessMinimum;
	uniform float iridescenceThicknessMaximum;
#endif
#ifdef USE_SHEEN
	uniform vec3 sheenColor;
	uniform float sheenRoughness;
	#ifdef USE_SHEEN_COLORMAP
		uniform sampler2D sheenColorMap;
	#endif
	#ifdef USE_SHEEN_ROUGHNESSMAP
		uniform sampler2D sheenRoughnessMap;
	#endif
#endif
#ifdef USE_ANISOTROPY
	uniform vec2 anisotropyVector;
	#ifdef USE_ANISOTROPYMAP
		uniform sampler2D anisotropyMap;
	#endif
#endif
varying vec3 vViewPosition;
#include <common>
#include <dithering_pars_fragment>
#include <color_pars_fragment>
#include <uv_pars_fragment>
#include <map_pars_fragment>
#include <alphamap_pars_fragment>
#include <alphatest_pars_fragment>
#include <alphahash_pars_fragment>
#include <aomap_pars_fragment>
#include <lightmap_pars_fragment>
#include <emissivemap_pars_fragment>
#include <iridescence_fragment>
#include <envmap_common_pars_fragment>
#include <envmap_physical_pars_fragment>
#include <fog_pars_fragment>
#include <lights_pars_begin>
#include <normal_pars_fragment>
#include <lights_physical_pars_fragment>
#include <transmission_pars_fragment>
#include <shadowmap_pars_fragment>
#include <bumpmap_pars_fragment>
#include <normalmap_pars_fragment>
#include <clearcoat_pars_fragment>
#include <iridescence_pars_fragment>
#include <roughnessmap_pars_fragment>
#include <metalnessmap_pars_fragment>
#include <logdepthbuf_pars_fragment>
#include <clipping_planes_pars_fragment>
void main() {
	vec4 diffuseColor = vec4( diffuse, opacity );
	#include <clipping_planes_fragment>
	ReflectedLight reflectedLight = ReflectedLight( vec3( 0.0 ), vec3( 0.0 ), vec3( 0.0 ), vec3( 0.0 ) );
	vec3 totalEmissiveRadiance = emissive;
	#include <logdepthbuf_fragment>
	#include <map_fragment>
	#include <color_fragment>
	#include <alphamap_fragment>
	#include <alphatest_fragment>
	#include <alphahash_fragment>
	#include <roughnessmap_fragment>
	#include <metalnessmap_fragment>
	#include <normal_fragment_begin>
	#include <normal_fragment_maps>
	#include <clearcoat_normal_fragment_begin>
	#include <clearcoat_normal_fragment_maps>
	#include <emissivemap_fragment>
	#include <lights_physical_fragment>
	#include <lights_fragment_begin>
	#include <lights_fragment_maps>
	#include <lights_fragment_end>
	#include <aomap_fragment>
	vec3 totalDiffuse = reflectedLight.directDiffuse + reflectedLight.indirectDiffuse;
	vec3 totalSpecular = reflectedLight.directSpecular + reflectedLight.indirectSpecular;
	#include <transmission_fragment>
	vec3 outgoingLight = totalDiffuse + totalSpecular + totalEmissiveRadiance;
	#ifdef USE_SHEEN
 
		outgoingLight = outgoingLight + sheenSpecularDirect + sheenSpecularIndirect;
 
 	#endif
	#ifdef USE_CLEARCOAT
		float dotNVcc = saturate( dot( geometryClearcoatNormal, geometryViewDir ) );
		vec3 Fcc = F_Schlick( material.clearcoatF0, material.clearcoatF90, dotNVcc );
		outgoingLight = outgoingLight * ( 1.0 - material.clearcoat * Fcc ) + ( clearcoatSpecularDirect + clearcoatSpecularIndirect ) * material.clearcoat;
	#endif
	#include <opaque_fragment>
	#include <tonemapping_fragment>
	#include <colorspace_fragment>
	#include <fog_fragment>
	#include <premultiplied_alpha_fragment>
	#include <dithering_fragment>
}`,CS=`#define TOON
varying vec3 vViewPosition;
#include <common>
#include <batching_pars_vertex>
#include <uv_pars_vertex>
#include <displacementmap_pars_vertex>
#include <color_pars_vertex>
#include <fog_pars_vertex>
#include <normal_pars_vertex>
#include <morphtarget_pars_vertex>
#include <skinning_pars_vertex>
#include <shadowmap_pars_vertex>
#include <logdepthbuf_pars_vertex>
#include <clipping_planes_pars_vertex>
void main() {
	#include <uv_vertex>
	#include <color_vertex>
	#include <morphinstance_vertex>
	#include <morphcolor_vertex>
	#include <batching_vertex>
	#include <beginnormal_vertex>
	#include <morphnormal_vertex>
	#include <skinbase_vertex>
	#include <skinnormal_vertex>
	#include <defaultnormal_vertex>
	#include <normal_vertex>
	#include <begin_vertex>
	#include <morphtarget_vertex>
	#include <skinning_vertex>
	#include <displacementmap_vertex>
	#include <project_vertex>
	#include <logdepthbuf_vertex>
	#include <clipping_planes_vertex>
	vViewPosition = - mvPosition.xyz;
	#include <worldpos_vertex>
	#include <shadowmap_vertex>
	#include <fog_vertex>
}`,RS=`#define TOON
uniform vec3 diffuse;
uniform vec3 emissive;
uniform float opacity;
#include <common>
#include <dithering_pars_fragment>
#include <color_pars_fragment>
#include <uv_pars_fragment>
#include <map_pars_fragment>
#include <alphamap_pars_fragment>
#include <alphatest_pars_fragment>
#include <alphahash_pars_fragment>
#include <aomap_pars_fragment>
#include <lightmap_pars_fragment>
#include <emissivemap_pars_fragment>
#include <gradientmap_pars_fragment>
#include <fog_pars_fragment>
#include <bsdfs>
#include <lights_pars_begin>
#include <normal_pars_fragment>
#include <lights_toon_pars_fragment>
#include <shadowmap_pars_fragment>
#include <bumpmap_pars_fragment>
#include <normalmap_pars_fragment>
#include <logdepthbuf_pars_fragment>
#include <clipping_planes_pars_fragment>
void main() {
	vec4 diffuseColor = vec4( diffuse, opacity );
	#include <clipping_planes_fragment>
	ReflectedLight reflectedLight = ReflectedLight( vec3( 0.0 ), vec3( 0.0 ), vec3( 0.0 ), vec3( 0.0 ) );
	vec3 totalEmissiveRadiance = emissive;
	#include <logdepthbuf_fragment>
	#include <map_fragment>
	#include <color_fragment>
	#include <alphamap_fragment>
	#include <alphatest_fragment>
	#include <alphahash_fragment>
	#include <normal_fragment_begin>
	#include <normal_fragment_maps>
	#include <emissivemap_fragment>
	#include <lights_toon_fragment>
	#include <lights_fragment_begin>
	#include <lights_fragment_maps>
	#include <lights_fragment_end>
	#include <aomap_fragment>
	vec3 outgoingLight = reflectedLight.directDiffuse + reflectedLight.indirectDiffuse + totalEmissiveRadiance;
	#include <opaque_fragment>
	#include <tonemapping_fragment>
	#include <colorspace_fragment>
	#include <fog_fragment>
	#include <premultiplied_alpha_fragment>
	#include <dithering_fragment>
}`,IS=`uniform float size;
uniform float scale;
#include <common>
#include <color_pars_vertex>
#include <fog_pars_vertex>
#include <morphtarget_pars_vertex>
#include <logdepthbuf_pars_vertex>
#include <clipping_planes_pars_vertex>
#ifdef USE_POINTS_UV
	varying vec2 vUv;
	uniform mat3 uvTransform;
#endif
void main() {
	#ifdef USE_POINTS_UV
		vUv = ( uvTransform * vec3( uv, 1 ) ).xy;
	#endif
	#include <color_vertex>
	#include <morphinstance_vertex>
	#include <morphcolor_vertex>
	#include <begin_vertex>
	#include <morphtarget_vertex>
	#include <project_vertex>
	gl_PointSize = size;
	#ifdef USE_SIZEATTENUATION
		bool isPerspective = isPerspectiveMatrix( projectionMatrix );
		if ( isPerspective ) gl_PointSize *= ( scale / - mvPosition.z );
	#endif
	#include <logdepthbuf_vertex>
	#include <clipping_planes_vertex>
	#include <worldpos_vertex>
	#include <fog_vertex>
}`,PS=`uniform vec3 diffuse;
uniform float opacity;
#include <common>
#include <color_pars_fragment>
#include <map_particle_pars_fragment>
#include <alphatest_pars_fragment>
#include <alphahash_pars_fragment>
#include <fog_pars_fragment>
#include <logdepthbuf_pars_fragment>
#include <clipping_planes_pars_fragment>
void main() {
	vec4 diffuseColor = vec4( diffuse, opacity );
	#include <clipping_planes_fragment>
	vec3 outgoingLight = vec3( 0.0 );
	#include <logdepthbuf_fragment>
	#include <map_particle_fragment>
	#include <color_fragment>
	#include <alphatest_fragment>
	#include <alphahash_fragment>
	outgoingLight = diffuseColor.rgb;
	#include <opaque_fragment>
	#include <tonemapping_fragment>
	#include <colorspace_fragment>
	#include <fog_fragment>
	#include <premultiplied_alpha_fragment>
}`,LS=`#include <common>
#include <batching_pars_vertex>
#include <fog_pars_vertex>
#include <morphtarget_pars_vertex>
#include <skinning_pars_vertex>
#include <logdepthbuf_pars_vertex>
#include <shadowmap_pars_vertex>
void main() {
	#include <batching_vertex>
	#include <beginnormal_vertex>
	#include <morphinstance_vertex>
	#include <morphnormal_vertex>
	#include <skinbase_vertex>
	#include <skinnormal_vertex>
	#include <defaultnormal_vertex>
	#include <begin_vertex>
	#include <morphtarget_vertex>
	#include <skinning_vertex>
	#include <project_vertex>
	#include <logdepthbuf_vertex>
	#include <worldpos_vertex>
	#include <shadowmap_vertex>
	#include <fog_vertex>
}`,DS=`uniform vec3 color;
uniform float opacity;
#include <common>
#include <fog_pars_fragment>
#include <bsdfs>
#include <lights_pars_begin>
#include <logdepthbuf_pars_fragment>
#include <shadowmap_pars_fragment>
#include <shadowmask_pars_fragment>
void main() {
	#include <logdepthbuf_fragment>
	gl_FragColor = vec4( color, opacity * ( 1.0 - getShadowMask() ) );
	#include <tonemapping_fragment>
	#include <colorspace_fragment>
	#include <fog_fragment>
	#include <premultiplied_alpha_fragment>
}`,NS=`uniform float rotation;
uniform vec2 center;
#include <common>
#include <uv_pars_vertex>
#include <fog_pars_vertex>
#include <logdepthbuf_pars_vertex>
#include <clipping_planes_pars_vertex>
void main() {
	#include <uv_vertex>
	vec4 mvPosition = modelViewMatrix[ 3 ];
	vec2 scale = vec2( length( modelMatrix[ 0 ].xyz ), length( modelMatrix[ 1 ].xyz ) );
	#ifndef USE_SIZEATTENUATION
		bool isPerspective = isPerspectiveMatrix( projectionMatrix );
		if ( isPerspective ) scale *= - mvPosition.z;
	#endif
	vec2 alignedPosition = ( position.xy - ( center - vec2( 0.5 ) ) ) * scale;
	vec2 rotatedPosition;
	rotatedPosition.x = cos( rotation ) * alignedPosition.x - sin( rotation ) * alignedPosition.y;
	rotatedPosition.y = sin( rotation ) * alignedPosition.x + cos( rotation ) * alignedPosition.y;
	mvPosition.xy += rotatedPosition;
	gl_Position = projectionMatrix * mvPosition;
	#include <logdepthbuf_vertex>
	#include <clipping_planes_vertex>
	#include <fog_vertex>
}`,US=`uniform vec3 diffuse;
uniform float opacity;
#include <common>
#include <uv_pars_fragment>
#include <map_pars_fragment>
#include <alphamap_pars_fragment>
#include <alphatest_pars_fragment>
#include <alphahash_pars_fragment>
#include <fog_pars_fragment>
#include <logdepthbuf_pars_fragment>
#include <clipping_planes_pars_fragment>
void main() {
	vec4 diffuseColor = vec4( diffuse, opacity );
	#include <clipping_planes_fragment>
	vec3 outgoingLight = vec3( 0.0 );
	#include <logdepthbuf_fragment>
	#include <map_fragment>
	#include <alphamap_fragment>
	#include <alphatest_fragment>
	#include <alphahash_fragment>
	outgoingLight = diffuseColor.rgb;
	#include <opaque_fragment>
	#include <tonemapping_fragment>
	#include <colorspace_fragment>
	#include <fog_fragment>
}`,fe={alphahash_fragment:iy,alphahash_pars_fragment:sy,alphamap_fragment:ry,alphamap_pars_fragment:oy,alphatest_fragment:ay,alphatest_pars_fragment:ly,aomap_fragment:cy,aomap_pars_fragment:hy,batching_pars_vertex:uy,batching_vertex:dy,begin_vertex:fy,beginnormal_vertex:py,bsdfs:my,iridescence_fragment:gy,bumpmap_pars_fragment:_y,clipping_planes_fragment:xy,clipping_planes_pars_fragment:yy,clipping_planes_pars_vertex:vy,clipping_planes_vertex:Sy,color_fragment:by,color_pars_fragment:My,color_pars_vertex:wy,color_vertex:Ty,common:Ay,defaultnormal_vertex:Ey,displacementmap_pars_vertex:Cy,displacementmap_vertex:Ry,emissivemap_fragment:Iy,emissivemap_pars_fragment:Py,colorspace_fragment:Ly,colorspace_pars_fragment:Dy,envmap_fragment:Ny,envmap_common_pars_fragment:Uy,envmap_pars_fragment:Oy,envmap_pars_vertex:Fy,envmap_physical_pars_fragment:$y,envmap_vertex:By,fog_vertex:ky,fog_pars_vertex:zy,fog_fragment:Vy,fog_pars_fragment:Gy,gradientmap_pars_fragment:Hy,lightmap_pars_fragment:Wy,lights_lambert_fragment:Xy,lights_lambert_pars_fragment:qy,lights_pars_begin:Yy,lights_toon_fragment:Ky,lights_toon_pars_fragment:Zy,lights_phong_fragment:Jy,lights_phong_pars_fragment:jy,lights_physical_fragment:Qy,lights_physical_pars_fragment:tv,lights_fragment_begin:ev,lights_fragment_maps:nv,lights_fragment_end:iv,lightprobes_pars_fragment:sv,logdepthbuf_fragment:rv,logdepthbuf_pars_fragment:ov,logdepthbuf_pars_vertex:av,logdepthbuf_vertex:lv,map_fragment:cv,map_pars_fragment:hv,map_particle_fragment:uv,map_particle_pars_fragment:dv,metalnessmap_fragment:fv,metalnessmap_pars_fragment:pv,morphinstance_vertex:mv,morphcolor_vertex:gv,morphnormal_vertex:_v,morphtarget_pars_vertex:xv,morphtarget_vertex:yv,normal_fragment_begin:vv,normal_fragment_maps:Sv,normal_pars_fragment:bv,normal_pars_vertex:Mv,normal_vertex:wv,normalmap_pars_fragment:Tv,clearcoat_normal_fragment_begin:Av,clearcoat_normal_fragment_maps:Ev,clearcoat_pars_fragment:Cv,iridescence_pars_fragment:Rv,opaque_fragment:Iv,packing:Pv,premultiplied_alpha_fragment:Lv,project_vertex:Dv,dithering_fragment:Nv,dithering_pars_fragment:Uv,roughnessmap_fragment:Ov,roughnessmap_pars_fragment:Fv,shadowmap_pars_fragment:Bv,shadowmap_pars_vertex:kv,shadowmap_vertex:zv,shadowmask_pars_fragment:Vv,skinbase_vertex:Gv,skinning_pars_vertex:Hv,skinning_vertex:Wv,skinnormal_vertex:Xv,specularmap_fragment:qv,specularmap_pars_fragment:Yv,tonemapping_fragment:$v,tonemapping_pars_fragment:Kv,transmission_fragment:Zv,transmission_pars_fragment:Jv,uv_pars_fragment:jv,uv_pars_vertex:Qv,uv_vertex:tS,worldpos_vertex:eS,background_vert:nS,background_frag:iS,backgroundCube_vert:sS,backgroundCube_frag:rS,cube_vert:oS,cube_frag:aS,depth_vert:lS,depth_frag:cS,distance_vert:hS,distance_frag:uS,equirect_vert:dS,equirect_frag:fS,linedashed_vert:pS,linedashed_frag:mS,meshbasic_vert:gS,meshbasic_frag:_S,meshlambert_vert:xS,meshlambert_frag:yS,meshmatcap_vert:vS,meshmatcap_frag:SS,meshnormal_vert:bS,meshnormal_frag:MS,meshphong_vert:wS,meshphong_frag:TS,meshphysical_vert:AS,meshphysical_frag:ES,meshtoon_vert:CS,meshtoon_frag:RS,points_vert:IS,points_frag:PS,shadow_vert:LS,shadow_frag:DS,sprite_vert:NS,sprite_frag:US},Pt={common:{diffuse:{value:new he(16777215)},opacity:{value:1},map:{value:null},mapTransform:{value:new ie},alphaMap:{value:null},alphaMapTransform:{value:new ie},alphaTest:{value:0}},specularmap:{specularMap:{value:null},specularMapTransform:{value:new ie}},envmap:{envMap:{value:null},envMapRotation:{value:new ie},reflectivity:{value:1},ior:{value:1.5},refractionRatio:{value:.98},dfgLUT:{value:null}},aomap:{aoMap:{value:null},aoMapIntensity:{value:1},aoMapTransform:{value:new ie}},lightmap:{lightMap:{value:null},lightMapIntensity:{value:1},lightMapTransform:{value:new ie}},bumpmap:{bumpMap:{value:null},bumpMapTransform:{value:new ie},bumpScale:{value:1}},normalmap:{normalMap:{value:null},normalMapTransform:{value:new ie},normalScale:{value:new Zt(1,1)}},displacementmap:{displacementMap:{value:null},displacementMapTransform:{value:new ie},displacementScale:{value:1},displacementBias:{value:0}},emissivemap:{emissiveMap:{value:null},emissiveMapTransform:{value:new ie}},metalnessmap:{metalnessMap:{value:null},metalnessMapTransform:{value:new ie}},roughnessmap:{roughnessMap:{value:null},roughnessMapTransform:{value:new ie}},gradientmap:{gradientMap:{value:null}},fog:{fogDensity:{value:25e-5},fogNear:{value:1},fogFar:{value:2e3},fogColor:{value:new he(16777215)}},lights:{ambientLightColor:{value:[]},lightProbe:{value:[]},sunLights:{value:[],properties:{direction:{},color:{}}},sunLightShadows:{value:[],properties:{shadowIntensity:1,shadowBias:{},shadowNormalBias:{},shadowRadius:{},shadowMapSize:{}}},sunShadowMatrix:{value:[]},sunShadowCascade:{value:[]},directionalLights:{value:[],properties:{direction:{},color:{}}},directionalLightShadows:{value:[],properties:{shadowIntensity:1,shadowBias:{},shadowNormalBias:{},shadowRadius:{},shadowMapSize:{}}},directionalShadowMatrix:{value:[]},spotLights:{value:[],properties:{color:{},position:{},direction:{},distance:{},coneCos:{},penumbraCos:{},decay:{}}},spotLightShadows:{value:[],properties:{shadowIntensity:1,shadowBias:{},shadowNormalBias:{},shadowRadius:{},shadowMapSize:{}}},spotLightMap:{value:[]},spotLightMatrix:{value:[]},pointLights:{value:[],properties:{color:{},position:{},decay:{},distance:{}}},pointLightShadows:{value:[],properties:{shadowIntensity:1,shadowBias:{},shadowNormalBias:{},shadowRadius:{},shadowMapSize:{},shadowCameraNear:{},shadowCameraFar:{}}},pointShadowMatrix:{value:[]},hemisphereLights:{value:[],properties:{direction:{},skyColor:{},groundColor:{}}},rectAreaLights:{value:[],properties:{color:{},position:{},width:{},height:{}}},ltc_1:{value:null},ltc_2:{value:null},probesSH:{value:[]},probesMin:{value:[]},probesMax:{value:[]},probesResolution:{value:[]}},points:{diffuse:{value:new he(16777215)},opacity:{value:1},size:{value:1},scale:{value:1},map:{value:null},alphaMap:{value:null},alphaMapTransform:{value:new ie},alphaTest:{value:0},uvTransform:{value:new ie}},sprite:{diffuse:{value:new he(16777215)},opacity:{value:1},center:{value:new Zt(.5,.5)},rotation:{value:0},map:{value:null},mapTransform:{value:new ie},alphaMap:{value:null},alphaMapTransform:{value:new ie},alphaTest:{value:0}}},ii={basic:{uniforms:Wn([Pt.common,Pt.specularmap,Pt.envmap,Pt.aomap,Pt.lightmap,Pt.fog]),vertexShader:fe.meshbasic_vert,fragmentShader:fe.meshbasic_frag},lambert:{uniforms:Wn([Pt.common,Pt.specularmap,Pt.envmap,Pt.aomap,Pt.lightmap,Pt.emissivemap,Pt.bumpmap,Pt.normalmap,Pt.displacementmap,Pt.fog,Pt.lights,{emissive:{value:new he(0)},envMapIntensity:{value:1}}]),vertexShader:fe.meshlambert_vert,fragmentShader:fe.meshlambert_frag},phong:{uniforms:Wn([Pt.common,Pt.specularmap,Pt.envmap,Pt.aomap,Pt.lightmap,Pt.emissivemap,Pt.bumpmap,Pt.normalmap,Pt.displacementmap,Pt.fog,Pt.lights,{emissive:{value:new he(0)},specular:{value:new he(1118481)},shininess:{value:30},envMapIntensity:{value:1}}]),vertexShader:fe.meshphong_vert,fragmentShader:fe.meshphong_frag},standard:{uniforms:Wn([Pt.common,Pt.envmap,Pt.aomap,Pt.lightmap,Pt.emissivemap,Pt.bumpmap,Pt.normalmap,Pt.displacementmap,Pt.roughnessmap,Pt.metalnessmap,Pt.fog,Pt.lights,{emissive:{value:new he(0)},roughness:{value:1},metalness:{value:0},envMapIntensity:{value:1}}]),vertexShader:fe.meshphysical_vert,fragmentShader:fe.meshphysical_frag},toon:{uniforms:Wn([Pt.common,Pt.aomap,Pt.lightmap,Pt.emissivemap,Pt.bumpmap,Pt.normalmap,Pt.displacementmap,Pt.gradientmap,Pt.fog,Pt.lights,{emissive:{value:new he(0)}}]),vertexShader:fe.meshtoon_vert,fragmentShader:fe.meshtoon_frag},matcap:{uniforms:Wn([Pt.common,Pt.bumpmap,Pt.normalmap,Pt.displacementmap,Pt.fog,{matcap:{value:null}}]),vertexShader:fe.meshmatcap_vert,fragmentShader:fe.meshmatcap_frag},points:{uniforms:Wn([Pt.points,Pt.fog]),vertexShader:fe.points_vert,fragmentShader:fe.points_frag},dashed:{uniforms:Wn([Pt.common,Pt.fog,{scale:{value:1},dashSize:{value:1},totalSize:{value:2}}]),vertexShader:fe.linedashed_vert,fragmentShader:fe.linedashed_frag},depth:{uniforms:Wn([Pt.common,Pt.displacementmap]),vertexShader:fe.depth_vert,fragmentShader:fe.depth_frag},normal:{uniforms:Wn([Pt.common,Pt.bumpmap,Pt.normalmap,Pt.displacementmap,{opacity:{value:1}}]),vertexShader:fe.meshnormal_vert,fragmentShader:fe.meshnormal_frag},sprite:{uniforms:Wn([Pt.sprite,Pt.fog]),vertexShader:fe.sprite_vert,fragmentShader:fe.sprite_frag},background:{uniforms:{uvTransform:{value:new ie},t2D:{value:null},backgroundIntensity:{value:1}},vertexShader:fe.background_vert,fragmentShader:fe.background_frag},backgroundCube:{uniforms:{envMap:{value:null},backgroundBlurriness:{value:0},backgroundIntensity:{value:1},backgroundRotation:{value:new ie}},vertexShader:fe.backgroundCube_vert,fragmentShader:fe.backgroundCube_frag},cube:{uniforms:{tCube:{value:null},tFlip:{value:-1},opacity:{value:1}},vertexShader:fe.cube_vert,fragmentShader:fe.cube_frag},equirect:{uniforms:{tEquirect:{value:null}},vertexShader:fe.equirect_vert,fragmentShader:fe.equirect_frag},distance:{uniforms:Wn([Pt.common,Pt.displacementmap,{referencePosition:{value:new k},nearDistance:{value:1},farDistance:{value:1e3}}]),vertexShader:fe.distance_vert,fragmentShader:fe.distance_frag},shadow:{uniforms:Wn([Pt.lights,Pt.fog,{color:{value:new he(0)},opacity:{value:1}}]),vertexShader:fe.shadow_vert,fragmentShader:fe.shadow_frag}};ii.physical={uniforms:Wn([ii.standard.uniforms,{clearcoat:{value:0},clearcoatMap:{value:null},clearcoatMapTransform:{value:new ie},clearcoatNormalMap:{value:null},clearcoatNormalMapTransform:{value:new ie},clearcoatNormalScale:{value:new Zt(1,1)},clearcoatRoughness:{value:0},clearcoatRoughnessMap:{value:null},clearcoatRoughnessMapTransform:{value:new ie},diffuseRoughness:{value:0},diffuseRoughnessMap:{value:null},diffuseRoughnessMapTransform:{value:new ie},dispersion:{value:0},retroreflectivity:{value:0},iridescence:{value:0},iridescenceMap:{value:null},iridescenceMapTransform:{value:new ie},iridescenceIOR:{value:1.3},iridescenceThicknessMinimum:{value:100},iridescenceThicknessMaximum:{value:400},iridescenceThicknessMap:{value:null},iridescenceThicknessMapTransform:{value:new ie},sheen:{value:0},sheenColor:{value:new he(0)},sheenColorMap:{value:null},sheenColorMapTransform:{value:new ie},sheenRoughness:{value:1},sheenRoughnessMap:{value:null},sheenRoughnessMapTransform:{value:new ie},transmission:{value:0},transmissionMap:{value:null},transmissionMapTransform:{value:new ie},transmissionSamplerSize:{value:new Zt},transmissionSamplerMap:{value:null},thickness:{value:0},thicknessMap:{value:null},thicknessMapTransform:{value:new ie},attenuationDistance:{value:0},attenuationColor:{value:new he(0)},specularColor:{value:new he(1,1,1)},specularColorMap:{value:null},specularColorMapTransform:{value:new ie},specularIntensity:{value:1},specularIntensityMap:{value:null},specularIntensityMapTransform:{value:new ie},anisotropyVector:{value:new Zt},anisotropyMap:{value:null},anisotropyMapTransform:{value:new ie}}]),vertexShader:fe.meshphysical_vert,fragmentShader:fe.meshphysical_frag};var Rh={r:0,b:0,g:0},OS=new be,pg=new ie;pg.set(-1,0,0,0,1,0,0,0,1);function FS(i,t,e,n,s,r){let o=new he(0),a=s===!0?0:1,l,c,u=null,h=0,d=null;function f(v){let E=v.isScene===!0?v.background:null;if(E&&E.isTexture){let b=v.backgroundBlurriness>0;E=t.get(E,b)}return E}function m(v){let E=!1,b=f(v);b===null?p(o,a):b&&b.isColor&&(p(b,1),E=!0);let I=i.xr.getEnvironmentBlendMode();I==="additive"?e.buffers.color.setClear(0,0,0,1,r):I==="alpha-blend"&&e.buffers.color.setClear(0,0,0,0,r),(i.autoClear||E)&&(e.buffers.depth.setTest(!0),e.buffers.depth.setMask(!0),e.buffers.color.setMask(!0),i.clear(i.autoClearColor,i.autoClearDepth,i.autoClearStencil))}function y(v,E){let b=f(E);b&&b.isCubeTexture?(c===void 0&&(c=new Sn(new hs(1,1,1),new Ri({name:"BackgroundCubeMaterial",uniforms:Ir(ii.backgroundCube.uniforms),vertexShader:ii.backgroundCube.vertexShader,fragmentShader:ii.backgroundCube.fragmentShader,side:ni,depthTest:!1,depthWrite:!1,fog:!1,allowOverride:!1})),c.geometry.deleteAttribute("normal"),c.geometry.deleteAttribute("uv"),c.onBeforeRender=function(I,A,x){this.matrixWorld.copyPosition(x.matrixWorld)},Object.defineProperty(c.material,"envMap",{get:function(){return this.uniforms.envMap.value}}),n.update(c)),c.material.uniforms.envMap.value=b,c.material.uniforms.backgroundBlurriness.value=E.backgroundBlurriness,c.material.uniforms.backgroundIntensity.value=E.backgroundIntensity,c.material.uniforms.backgroundRotation.value.setFromMatrix4(OS.makeRotationFromEuler(E.backgroundRotation)).transpose(),b.isRenderTargetTexture===!1&&c.material.uniforms.backgroundRotation.value.premultiply(pg),c.material.toneMapped=ye.getTransfer(b.colorSpace)!==Re,(u!==b||h!==b.version||d!==i.toneMapping)&&(c.material.needsUpdate=!0,u=b,h=b.version,d=i.toneMapping),c.layers.enableAll(),v.unshift(c,c.geometry,c.material,0,0,null)):b&&b.isTexture&&(l===void 0&&(l=new Sn(new Tr(2,2),new Ri({name:"BackgroundMaterial",uniforms:Ir(ii.background.uniforms),vertexShader:ii.background.vertexShader,fragmentShader:ii.background.fragmentShader,side:lr,depthTest:!1,depthWrite:!1,fog:!1,allowOverride:!1})),l.geometry.deleteAttribute("normal"),Object.defineProperty(l.material,"map",{get:function(){return this.uniforms.t2D.value}}),n.update(l)),l.material.uniforms.t2D.value=b,l.material.uniforms.backgroundIntensity.value=E.backgroundIntensity,l.material.toneMapped=ye.getTransfer(b.colorSpace)!==Re,b.matrixAutoUpdate===!0&&b.updateMatrix(),l.material.uniforms.uvTransform.value.copy(b.matrix),(u!==b||h!==b.version||d!==i.toneMapping)&&(l.material.needsUpdate=!0,u=b,h=b.version,d=i.toneMapping),l.layers.enableAll(),v.unshift(l,l.geometry,l.material,0,0,null))}function p(v,E){v.getRGB(Rh,Bd(i)),e.buffers.color.setClear(Rh.r,Rh.g,Rh.b,E,r)}function g(){c!==void 0&&(c.geometry.dispose(),c.material.dispose(),c=void 0),l!==void 0&&(l.geometry.dispose(),l.material.dispose(),l=void 0)}return{getClearColor:function(){return o},setClearColor:function(v,E=1){o.set(v),a=E,p(o,a)},getClearAlpha:function(){return a},setClearAlpha:function(v){a=v,p(o,a)},render:m,addToRenderList:y,dispose:g}}function BS(i,t){let e=i.getParameter(i.MAX_VERTEX_ATTRIBS),n={},s=d(null),r=s,o=!1;function a(L,X,q,D,W){let J=!1,H=h(L,D,q,X);r!==H&&(r=H,c(r.object)),J=f(L,D,q,W),J&&m(L,D,q,W),W!==null&&t.update(W,i.ELEMENT_ARRAY_BUFFER),(J||o)&&(o=!1,b(L,X,q,D),W!==null&&i.bindBuffer(i.ELEMENT_ARRAY_BUFFER,t.get(W).buffer))}function l(){return i.createVertexArray()}function c(L){return i.bindVertexArray(L)}function u(L){return i.deleteVertexArray(L)}function h(L,X,q,D){let W=D.wireframe===!0,J=n[X.id];J===void 0&&(J={},n[X.id]=J);let H=L.isInstancedMesh===!0?L.id:0,ht=J[H];ht===void 0&&(ht={},J[H]=ht);let j=ht[q.id];j===void 0&&(j={},ht[q.id]=j);let tt=j[W];return tt===void 0&&(tt=d(l()),j[W]=tt),tt}function d(L){let X=[],q=[],D=[];for(let W=0;W<e;W++)X[W]=0,q[W]=0,D[W]=0;return{geometry:null,program:null,wireframe:!1,newAttributes:X,enabledAttributes:q,attributeDivisors:D,object:L,attributes:{},index:null}}function f(L,X,q,D){let W=r.attributes,J=X.attributes,H=0,ht=q.getAttributes();for(let j in ht)if(ht[j].location>=0){let rt=W[j],ft=J[j];if(ft===void 0&&(j==="instanceMatrix"&&L.instanceMatrix&&(ft=L.instanceMatrix),j==="instanceColor"&&L.instanceColor&&(ft=L.instanceColor)),rt===void 0||rt.attribute!==ft||ft&&rt.data!==ft.data)return!0;H++}return r.attributesNum!==H||r.index!==D}function m(L,X,q,D){let W={},J=X.attributes,H=0,ht=q.getAttributes();for(let j in ht)if(ht[j].location>=0){let rt=J[j];rt===void 0&&(j==="instanceMatrix"&&L.instanceMatrix&&(rt=L.instanceMatrix),j==="instanceColor"&&L.instanceColor&&(rt=L.instanceColor));let ft={};ft.attribute=rt,rt&&rt.data&&(ft.data=rt.data),W[j]=ft,H++}r.attributes=W,r.attributesNum=H,r.index=D}function y(){let L=r.newAttributes;for(let X=0,q=L.length;X<q;X++)L[X]=0}function p(L){g(L,0)}function g(L,X){let q=r.newAttributes,D=r.enabledAttributes,W=r.attributeDivisors;q[L]=1,D[L]===0&&(i.enableVertexAttribArray(L),D[L]=1),W[L]!==X&&(i.vertexAttribDivisor(L,X),W[L]=X)}function v(){let L=r.newAttributes,X=r.enabledAttributes;for(let q=0,D=X.length;q<D;q++)X[q]!==L[q]&&(i.disableVertexAttribArray(q),X[q]=0)}function E(L,X,q,D,W,J,H){H===!0?i.vertexAttribIPointer(L,X,q,W,J):i.vertexAttribPointer(L,X,q,D,W,J)}function b(L,X,q,D){y();let W=D.attributes,J=q.getAttributes(),H=X.defaultAttributeValues;for(let ht in J){let j=J[ht];if(j.location>=0){let tt=W[ht];if(tt===void 0&&(ht==="instanceMatrix"&&L.instanceMatrix&&(tt=L.instanceMatrix),ht==="instanceColor"&&L.instanceColor&&(tt=L.instanceColor)),tt!==void 0){let rt=tt.normalized,ft=tt.itemSize,dt=t.get(tt);if(dt===void 0)continue;let et=dt.buffer,gt=dt.type,yt=dt.bytesPerElement,Ct=gt===i.INT||gt===i.UNSIGNED_INT||tt.gpuType===Xc;if(tt.isInterleavedBufferAttribute){let Mt=tt.data,Xt=Mt.isInterleavedBuffer===!0?Mt.stride:Mt.itemSize,oe=tt.offset;if(Mt.isInstancedInterleavedBuffer||Mt.isInstancedBufferAttribute){for(let Ht=0;Ht<j.locationSize;Ht++)g(j.location+Ht,Mt.meshPerAttribute);L.isInstancedMesh!==!0&&D._maxInstanceCount===void 0&&(D._maxInstanceCount=Mt.meshPerAttribute*Mt.count)}else for(let Ht=0;Ht<j.locationSize;Ht++)p(j.location+Ht);i.bindBuffer(i.ARRAY_BUFFER,et);for(let Ht=0;Ht<j.locationSize;Ht++)E(j.location+Ht,ft/j.locationSize,gt,rt,Xt*yt,(oe+ft/j.locationSize*Ht)*yt,Ct)}else{if(tt.isInstancedBufferAttribute){for(let Mt=0;Mt<j.locationSize;Mt++)g(j.location+Mt,tt.meshPerAttribute);L.isInstancedMesh!==!0&&D._maxInstanceCount===void 0&&(D._maxInstanceCount=tt.meshPerAttribute*tt.count)}else for(let Mt=0;Mt<j.locationSize;Mt++)p(j.location+Mt);i.bindBuffer(i.ARRAY_BUFFER,et);for(let Mt=0;Mt<j.locationSize;Mt++)E(j.location+Mt,ft/j.locationSize,gt,rt,ft*yt,ft/j.locationSize*Mt*yt,Ct)}}else if(H!==void 0){let rt=H[ht];if(rt!==void 0)switch(rt.length){case 2:i.vertexAttrib2fv(j.location,rt);break;case 3:i.vertexAttrib3fv(j.location,rt);break;case 4:i.vertexAttrib4fv(j.location,rt);break;default:i.vertexAttrib1fv(j.location,rt)}}}}v()}function I(){V();for(let L in n){let X=n[L];for(let q in X){let D=X[q];for(let W in D){let J=D[W];for(let H in J)u(J[H].object),delete J[H];delete D[W]}}delete n[L]}}function A(L){if(n[L.id]===void 0)return;let X=n[L.id];for(let q in X){let D=X[q];for(let W in D){let J=D[W];for(let H in J)u(J[H].object),delete J[H];delete D[W]}}delete n[L.id]}function x(L){for(let X in n){let q=n[X];for(let D in q){let W=q[D];if(W[L.id]===void 0)continue;let J=W[L.id];for(let H in J)u(J[H].object),delete J[H];delete W[L.id]}}}function T(L){for(let X in n){let q=n[X],D=L.isInstancedMesh===!0?L.id:0,W=q[D];if(W!==void 0){for(let J in W){let H=W[J];for(let ht in H)u(H[ht].object),delete H[ht];delete W[J]}delete q[D],Object.keys(q).length===0&&delete n[X]}}}function V(){N(),o=!0,r!==s&&(r=s,c(r.object))}function N(){s.geometry=null,s.program=null,s.wireframe=!1}return{setup:a,reset:V,resetDefaultState:N,dispose:I,releaseStatesOfGeometry:A,releaseStatesOfObject:T,releaseStatesOfProgram:x,initAttributes:y,enableAttribute:p,disableUnusedAttributes:v}}function kS(i,t,e){let n;function s(l){n=l}function r(l,c){i.drawArrays(n,l,c),e.update(c,n,1)}function o(l,c,u){u!==0&&(i.drawArraysInstanced(n,l,c,u),e.update(c,n,u))}function a(l,c,u){if(u===0)return;t.get("WEBGL_multi_draw").multiDrawArraysWEBGL(n,l,0,c,0,u);let d=0;for(let f=0;f<u;f++)d+=c[f];e.update(d,n,1)}this.setMode=s,this.render=r,this.renderInstances=o,this.renderMultiDraw=a}function zS(i,t,e,n){let s;function r(){if(s!==void 0)return s;if(t.has("EXT_texture_filter_anisotropic")===!0){let x=t.get("EXT_texture_filter_anisotropic");s=i.getParameter(x.MAX_TEXTURE_MAX_ANISOTROPY_EXT)}else s=0;return s}function o(x){return!(x!==Xi&&n.convert(x)!==i.getParameter(i.IMPLEMENTATION_COLOR_READ_FORMAT))}function a(x){let T=x===Wi&&(t.has("EXT_color_buffer_half_float")||t.has("EXT_color_buffer_float"));return!(x!==oi&&x!==Hi&&!T&&n.convert(x)!==i.getParameter(i.IMPLEMENTATION_COLOR_READ_TYPE))}function l(x){if(x==="highp"){if(i.getShaderPrecisionFormat(i.VERTEX_SHADER,i.HIGH_FLOAT).precision>0&&i.getShaderPrecisionFormat(i.FRAGMENT_SHADER,i.HIGH_FLOAT).precision>0)return"highp";x="mediump"}return x==="mediump"&&i.getShaderPrecisionFormat(i.VERTEX_SHADER,i.MEDIUM_FLOAT).precision>0&&i.getShaderPrecisionFormat(i.FRAGMENT_SHADER,i.MEDIUM_FLOAT).precision>0?"mediump":"lowp"}let c=e.precision!==void 0?e.precision:"highp",u=l(c);u!==c&&($t("WebGLRenderer:",c,"not supported, using",u,"instead."),c=u);let h=e.reversedDepthBuffer===!0&&t.has("EXT_clip_control"),d=e.logarithmicDepthBuffer===!0&&h===!1;e.reversedDepthBuffer===!0&&h===!1&&$t("WebGLRenderer: Unable to use reversed depth buffer due to missing EXT_clip_control extension. Fallback to default depth buffer."),e.logarithmicDepthBuffer===!0&&h===!0&&$t("WebGLRenderer: Logarithmic depth buffer is ignored when reversed depth buffer is enabled.");let f=i.getParameter(i.MAX_TEXTURE_IMAGE_UNITS),m=i.getParameter(i.MAX_VERTEX_TEXTURE_IMAGE_UNITS),y=i.getParameter(i.MAX_TEXTURE_SIZE),p=i.getParameter(i.MAX_CUBE_MAP_TEXTURE_SIZE),g=i.getParameter(i.MAX_VERTEX_ATTRIBS),v=i.getParameter(i.MAX_VERTEX_UNIFORM_VECTORS),E=i.getParameter(i.MAX_VARYING_VECTORS),b=i.getParameter(i.MAX_FRAGMENT_UNIFORM_VECTORS),I=i.getParameter(i.MAX_SAMPLES),A=i.getParameter(i.SAMPLES);return{isWebGL2:!0,getMaxAnisotropy:r,getMaxPrecision:l,textureFormatReadable:o,textureTypeReadable:a,precision:c,logarithmicDepthBuffer:d,reversedDepthBuffer:h,maxTextures:f,maxVertexTextures:m,maxTextureSize:y,maxCubemapSize:p,maxAttributes:g,maxVertexUniforms:v,maxVaryings:E,maxFragmentUniforms:b,maxSamples:I,samples:A}}function VS(i){let t=this,e=null,n=0,s=!1,r=!1,o=new _i,a=new ie,l={value:null,needsUpdate:!1};this.uniform=l,this.numPlanes=0,this.numIntersection=0,this.init=function(h,d){let f=h.length!==0||d||n!==0||s;return s=d,n=h.length,f},this.beginShadows=function(){r=!0,u(null)},this.endShadows=function(){r=!1},this.setGlobalState=function(h,d){e=u(h,d,0)},this.setState=function(h,d,f){let m=h.clippingPlanes,y=h.clipIntersection,p=h.clipShadows,g=i.get(h);if(!s||m===null||m.length===0||r&&!p)r?u(null):c();else{let v=r?0:n,E=v*4,b=g.clippingState||null;l.value=b,b=u(m,d,E,f);for(let I=0;I!==E;++I)b[I]=e[I];g.clippingState=b,this.numIntersection=y?this.numPlanes:0,this.numPlanes+=v}};function c(){l.value!==e&&(l.value=e,l.needsUpdate=n>0),t.numPlanes=n,t.numIntersection=0}function u(h,d,f,m){let y=h!==null?h.length:0,p=null;if(y!==0){if(p=l.value,m!==!0||p===null){let g=f+y*4,v=d.matrixWorldInverse;a.getNormalMatrix(v),(p===null||p.length<g)&&(p=new Float32Array(g));for(let E=0,b=f;E!==y;++E,b+=4)o.copy(h[E]).applyMatrix4(v,a),o.normal.toArray(p,b),p[b+3]=o.constant}l.value=p,l.needsUpdate=!0}return t.numPlanes=y,t.numIntersection=0,p}}var nl=class extends xi{constructor(t=1,e={}){super(t,t,e),this.isWebGLCubeRenderTarget=!0;let n={width:t,height:t,depth:1},s=[n,n,n,n,n,n];this.texture=new Ia(s),this._setTextureOptions(e),this.texture.isRenderTargetTexture=!0}fromEquirectangularTexture(t,e){this.texture.type=e.type,this.texture.colorSpace=e.colorSpace,this.texture.generateMipmaps=e.generateMipmaps,this.texture.minFilter=e.minFilter,this.texture.magFilter=e.magFilter;let n={uniforms:{tEquirect:{value:null}},vertexShader:`

				varying vec3 vWorldDirection;

				vec3 transformDirection( in vec3 dir, in mat4 matrix ) {

					return normalize( ( matrix * vec4( dir, 0.0 ) ).xyz );

				}

				void main() {

					vWorldDirection = transformDirection( position, modelMatrix );

					#include <begin_vertex>
					#include <project_vertex>

				}
			`,fragmentShader:`

				uniform sampler2D tEquirect;

				varying vec3 vWorldDirection;

				#include <common>

				void main() {

					vec3 direction = normalize( vWorldDirection );

					vec2 sampleUV = equirectUv( direction );

					gl_FragColor = texture2D( tEquirect, sampleUV );

				}
			`},s=new hs(5,5,5),r=new Ri({name:"CubemapFromEquirect",uniforms:Ir(n.uniforms),vertexShader:n.vertexShader,fragmentShader:n.fragmentShader,side:ni,blending:Ar});r.uniforms.tEquirect.value=e;let o=new Sn(s,r),a=e.minFilter;return e.minFilter===Us&&(e.minFilter=ti),new Uo(1,10,this).update(t,o),e.minFilter=a,o.geometry.dispose(),o.material.dispose(),this}clear(t,e=!0,n=!0,s=!0){let r=t.getRenderTarget();for(let o=0;o<6;o++)t.setRenderTarget(this,o),t.clear(e,n,s);t.setRenderTarget(r)}},qm=256,GS=3,HS=20,mg=256,gg=16,WS=3,XS=new k,qS=new he,Ph=class i{constructor(t){this._renderer=t,this._cubeSize=0,this._sourceTarget=null,this._cubeCamera=new Uo(1,10,null),this._boxMesh=new Sn(new hs(5,5,5),null),this._cubemapMaterial=null,this._equirectMaterial=null,this._blurMaterial=null,this._ggxMaterial=null,this._integrationMaterial=null}fromScene(t,e=0,n=.1,s=100,r={}){let{size:o=256,position:a=XS}=r,l=this._renderer;this._setSize(o);let c=this._allocateTarget(),u=this._getSourceTarget(!0);e>0&&(u.texture.mipmapsAutoUpdate=!1);let h=l.autoClear,d=l.autoClearColor,f=l.autoClearDepth,m=l.autoClearStencil,y=t.background;l.autoClear=!0,l.autoClearColor=!0,l.autoClearDepth=!0,l.autoClearStencil=!0,y===null&&(t.background=l.getClearColor(qS));let p=new Uo(n,s,u);return p.position.copy(a),p.update(l,t),l.autoClear=h,l.autoClearColor=d,l.autoClearDepth=f,l.autoClearStencil=m,t.background=y,e>0&&(u.texture.mipmapsAutoUpdate=!0,this._blur(c,e)),this._applyPMREM(c),c}fromEquirectangular(t,e=null){return this._fromTexture(t,e)}fromCubemap(t,e=null){return this._fromTexture(t,e)}compileCubemapShader(){this._cubemapMaterial===null&&(this._cubemapMaterial=Km(),this._compileMaterial(this._cubemapMaterial))}compileEquirectangularShader(){this._equirectMaterial===null&&(this._equirectMaterial=$m(),this._compileMaterial(this._equirectMaterial))}dispose(){this._sourceTarget!==null&&this._sourceTarget.dispose(),this._cubemapMaterial!==null&&this._cubemapMaterial.dispose(),this._equirectMaterial!==null&&this._equirectMaterial.dispose(),this._blurMaterial!==null&&this._blurMaterial.dispose(),this._ggxMaterial!==null&&this._ggxMaterial.dispose(),this._integrationMaterial!==null&&this._integrationMaterial.dispose(),this._boxMesh.geometry.dispose()}static lodToRoughness(t,e){return e>0?1-Math.sqrt(1-t/e):0}_setSize(t){this._cubeSize=Math.max(qm,Ud(t))}_fromTexture(t,e){t.mapping===Cr||t.mapping===ko?this._setSize(t.image.length===0?qm:t.image[0].width||t.image[0].image.width):this._setSize(t.image.width/4);let n=e||this._allocateTarget();return this._textureToCubemap(t),this._applyPMREM(n),n}_allocateTarget(){let t=this._cubeSize,e=Ym(t,!1,!1),n=Math.log2(t)-GS;for(let s=0;s<=n;s++)e.texture.mipmaps.push({width:t>>s,height:t>>s});return e.texture.name="PMREM",e.texture.isPMREMTexture=!0,e}_getSourceTarget(t=!1){let e=this._cubeSize,n=this._sourceTarget;return(n===null||n.width!==e||t&&n.depthBuffer===!1)&&(n!==null&&n.dispose(),this._sourceTarget=Ym(e,!0,t)),this._sourceTarget}_compileMaterial(t){this._boxMesh.material=t,this._renderer.compile(this._boxMesh,this._cubeCamera.children[0])}_renderCube(t,e,n){let s=this._boxMesh,r=this._cubeCamera;s.material=n,r.renderTarget=t,r.activeMipmapLevel=e;let o=t.width>>e;t.viewport.set(0,0,o,o),r.update(this._renderer,s),t.viewport.set(0,0,t.width,t.height)}_textureToCubemap(t){let e;t.mapping===Cr||t.mapping===ko?(this._cubemapMaterial===null&&(this._cubemapMaterial=Km()),e=this._cubemapMaterial,e.uniforms.flipEnvMap.value=t.isRenderTargetTexture===!1?-1:1):(this._equirectMaterial===null&&(this._equirectMaterial=$m()),e=this._equirectMaterial),e.uniforms.envMap.value=t,this._renderCube(this._getSourceTarget(),0,e)}_applyPMREM(t){this._ggxMaterial===null&&(this._ggxMaterial=YS(),this._integrationMaterial=$S());let e=this._cubeSize,n=t.texture.mipmaps.length-1,s=this._ggxMaterial.uniforms;s.envMap.value=this._sourceTarget.texture;let r=this._integrationMaterial.uniforms;r.envMap.value=this._sourceTarget.texture,r.sourceLod.value=Math.log2(e/gg);for(let o=0;o<=n;o++){let a=i.lodToRoughness(o,n);if(o>n-WS)r.roughness.value=a,this._renderCube(t,o,this._integrationMaterial);else{let l=a>0?Math.log2(e)+.5*Math.log2(6/(mg*Math.pow(a,4)))+.5:0;s.roughness.value=a,s.lodBias.value=l,this._renderCube(t,o,this._ggxMaterial)}}}_blur(t,e){this._blurMaterial===null&&(this._blurMaterial=KS());let n=this._blurMaterial,s=n.uniforms,r=this._sourceTarget;s.sigma.value=Math.min(e,Math.PI)/Math.SQRT2,s.envMap.value=r.texture,this._renderCube(t,0,n),s.envMap.value=t.texture,this._renderCube(r,0,n)}};function Ym(i,t,e){return new nl(i,{minFilter:Us,generateMipmaps:t,type:Wi,colorSpace:ba,depthBuffer:e})}function il(i,t,e){return new Ri({name:i,uniforms:t,vertexShader:fe.cube_vert,fragmentShader:e,side:ni,blending:Ar,depthTest:!1,depthWrite:!1})}function YS(){return il("PMREMGGXConvolution",{envMap:{value:null},roughness:{value:0},lodBias:{value:0}},`

		#define GGX_SAMPLES ${mg}u

		varying vec3 vWorldDirection;

		uniform samplerCube envMap;
		uniform float roughness;
		uniform float lodBias;

		#include <common>

		// Van der Corput radical inverse
		float radicalInverse_VdC( uint bits ) {

			bits = ( bits << 16u ) | ( bits >> 16u );
			bits = ( ( bits & 0x55555555u ) << 1u ) | ( ( bits & 0xAAAAAAAAu ) >> 1u );
			bits = ( ( bits & 0x33333333u ) << 2u ) | ( ( bits & 0xCCCCCCCCu ) >> 2u );
			bits = ( ( bits & 0x0F0F0F0Fu ) << 4u ) | ( ( bits & 0xF0F0F0F0u ) >> 4u );
			bits = ( ( bits & 0x00FF00FFu ) << 8u ) | ( ( bits & 0xFF00FF00u ) >> 8u );
			return float( bits ) * 2.3283064365386963e-10; // / 0x100000000

		}

		// Hammersley sequence
		vec2 hammersley( uint i, uint N ) {

			return vec2( float( i ) / float( N ), radicalInverse_VdC( i ) );

		}

		void main() {

			vec3 N = normalize( vWorldDirection );

			// For very low roughness, just sample the environment directly
			if ( roughness < 0.001 ) {

				gl_FragColor = vec4( textureLod( envMap, N, 0.0 ).rgb, 1.0 );
				return;

			}

			float alpha = roughness * roughness;
			float alpha2 = alpha * alpha;

			// Tangent space basis for VNDF sampling
			vec3 up = abs( N.z ) < 0.999 ? vec3( 0.0, 0.0, 1.0 ) : vec3( 1.0, 0.0, 0.0 );
			vec3 tangent = normalize( cross( up, N ) );
			vec3 bitangent = cross( N, tangent );

			vec3 prefilteredColor = vec3( 0.0 );
			float totalWeight = 0.0;

			for ( uint i = 0u; i < GGX_SAMPLES; i ++ ) {

				vec2 Xi = hammersley( i, GGX_SAMPLES );

				// With V = N, sample the reflected direction directly.
				float invQ = 1.0 / ( 1.0 - Xi.x + alpha2 * Xi.x );
				float NdotL = ( 1.0 - Xi.x - alpha2 * Xi.x ) * invQ;

				if ( NdotL > 0.0 ) {

					float phi = 2.0 * PI * Xi.y;
					float sinTheta = 2.0 * alpha * sqrt( Xi.x * ( 1.0 - Xi.x ) ) * invQ;
					vec3 L = N * NdotL + ( tangent * cos( phi ) + bitangent * sin( phi ) ) * sinTheta;

					// Match the source mip to the sample's solid angle. The terms
					// independent of the sample are precomputed in lodBias.
					float d = alpha2 * invQ;
					float lod = max( log2( d ) + lodBias, 0.0 );

					// Weight by NdotL for the split-sum approximation
					prefilteredColor += textureLod( envMap, L, lod ).rgb * NdotL;
					totalWeight += NdotL;

				}

			}

			gl_FragColor = vec4( prefilteredColor / totalWeight, 1.0 );

		}
	`)}function $S(){return il("PMREMGGXIntegration",{envMap:{value:null},roughness:{value:0},sourceLod:{value:0},sourceSize:{value:gg}},`

		varying vec3 vWorldDirection;

		uniform samplerCube envMap;
		uniform float roughness;
		uniform float sourceLod;
		uniform int sourceSize;

		void main() {

			vec3 N = normalize( vWorldDirection );

			float alpha = roughness * roughness;
			float alpha2 = alpha * alpha;

			float texelSize = 2.0 / float( sourceSize );

			vec3 prefilteredColor = vec3( 0.0 );
			float totalWeight = 0.0;

			// Pair opposite texels: only the one in N's hemisphere contributes.
			for ( int face = 0; face < 3; face ++ ) {

				for ( int y = 0; y < sourceSize; y ++ ) {

					for ( int x = 0; x < sourceSize; x ++ ) {

						vec2 uv = ( vec2( x, y ) + 0.5 ) * texelSize - 1.0;
						vec3 texelDirection = face == 0 ? vec3( 1.0, uv ) : ( face == 1 ? vec3( uv.x, 1.0, uv.y ) : vec3( uv, 1.0 ) );

						float invDistance = inversesqrt( 1.0 + dot( uv, uv ) );
						float NdotL = dot( N, texelDirection );
						texelDirection *= NdotL < 0.0 ? - 1.0 : 1.0;
						NdotL = abs( NdotL ) * invDistance;

						// With V = N, NdotH squared is ( 1 + NdotL ) / 2. Common factors
						// in the GGX distribution and texel solid angle cancel when normalized.
						float d = 1.0 + alpha2 + ( alpha2 - 1.0 ) * NdotL;
						float weight = NdotL * invDistance * invDistance * invDistance / ( d * d );

						prefilteredColor += textureLod( envMap, texelDirection, sourceLod ).rgb * weight;
						totalWeight += weight;

					}

				}

			}

			gl_FragColor = vec4( prefilteredColor / totalWeight, 1.0 );

		}
	`)}function KS(){return il("PMREMSphericalGaussianBlur",{envMap:{value:null},sigma:{value:0}},`

		#define SAMPLES ${HS}
		#define GOLDEN_ANGLE 2.39996322973

		varying vec3 vWorldDirection;

		uniform samplerCube envMap;
		uniform float sigma;

		#include <common>

		void main() {

			vec3 outputDirection = normalize( vWorldDirection );

			vec3 up = abs( outputDirection.z ) < 0.999 ? vec3( 0.0, 0.0, 1.0 ) : vec3( 1.0, 0.0, 0.0 );
			vec3 tangent = normalize( cross( up, outputDirection ) );
			vec3 bitangent = cross( outputDirection, tangent );

			// Truncate the kernel at three standard deviations or at the antipode.
			float thetaMax = min( 3.0 * sigma, PI );
			float truncation = 1.0 - exp( - 0.5 * thetaMax * thetaMax / ( sigma * sigma ) );

			vec3 accumColor = vec3( 0.0 );
			float accumWeight = 0.0;

			for ( int i = 0; i < SAMPLES; i ++ ) {

				// Stratified inverse-CDF sampling of the Gaussian, placed on a golden-angle spiral.
				float stratum = ( float( i ) + 0.5 ) / float( SAMPLES );
				float theta = sigma * sqrt( - 2.0 * log( 1.0 - stratum * truncation ) );
				float phi = float( i ) * GOLDEN_ANGLE;

				vec3 offset = cos( phi ) * tangent + sin( phi ) * bitangent;
				vec3 sampleDirection = cos( theta ) * outputDirection + sin( theta ) * offset;

				// Correct the planar sample density to solid angle.
				float weight = sin( theta ) / theta;

				accumColor += weight * textureLod( envMap, sampleDirection, 0.0 ).rgb;
				accumWeight += weight;

			}

			gl_FragColor = vec4( accumColor / accumWeight, 1.0 );

		}
	`)}function $m(){return il("PMREMEquirectangularToCubemap",{envMap:{value:null}},`

		varying vec3 vWorldDirection;

		uniform sampler2D envMap;

		#include <common>

		void main() {

			// Average four subpixel samples to preserve small, bright features.
			vec3 direction = normalize( vWorldDirection );
			vec3 dx = dFdx( direction ) * 0.25;
			vec3 dy = dFdy( direction ) * 0.25;

			vec3 color = textureLod( envMap, equirectUv( normalize( direction - dx - dy ) ), 0.0 ).rgb;
			color += textureLod( envMap, equirectUv( normalize( direction + dx - dy ) ), 0.0 ).rgb;
			color += textureLod( envMap, equirectUv( normalize( direction - dx + dy ) ), 0.0 ).rgb;
			color += textureLod( envMap, equirectUv( normalize( direction + dx + dy ) ), 0.0 ).rgb;
			gl_FragColor = vec4( color * 0.25, 1.0 );

		}
	`)}function Km(){return il("PMREMCubemapToCubemap",{envMap:{value:null},flipEnvMap:{value:-1}},`

		varying vec3 vWorldDirection;

		uniform samplerCube envMap;
		uniform float flipEnvMap;

		void main() {

			gl_FragColor = vec4( textureCube( envMap, vec3( flipEnvMap * vWorldDirection.x, vWorldDirection.yz ) ).rgb, 1.0 );

		}
	`)}function ZS(i){let t=new WeakMap,e=new WeakMap,n=null;function s(d,f=!1){return d==null?null:f?o(d):r(d)}function r(d){if(d&&d.isTexture){let f=d.mapping;if(f===Gc||f===Hc)if(t.has(d)){let m=t.get(d).texture;return a(m,d.mapping)}else{let m=d.image;if(m&&m.height>0){let y=new nl(m.height);return y.fromEquirectangularTexture(i,d),t.set(d,y),d.addEventListener("dispose",c),a(y.texture,d.mapping)}else return null}}return d}function o(d){if(d&&d.isTexture&&d.isPMREMTexture!==!0){let f=d.mapping,m=f===Gc||f===Hc,y=f===Cr||f===ko;if(m||y){let p=e.get(d),g=p!==void 0?p.texture.pmremVersion:0;if(d.isRenderTargetTexture&&d.pmremVersion!==g)return n===null&&(n=new Ph(i)),p=m?n.fromEquirectangular(d,p):n.fromCubemap(d,p),p.texture.pmremVersion=d.pmremVersion,e.set(d,p),p.texture;if(p!==void 0)return p.texture;{let v=d.image;return m&&v&&v.height>0||y&&v&&l(v)?(n===null&&(n=new Ph(i)),p=m?n.fromEquirectangular(d):n.fromCubemap(d),p.texture.pmremVersion=d.pmremVersion,e.set(d,p),d.addEventListener("dispose",u),p.texture):null}}}return d}function a(d,f){return f===Gc?d.mapping=Cr:f===Hc&&(d.mapping=ko),d}function l(d){let f=0,m=6;for(let y=0;y<m;y++)d[y]!==void 0&&f++;return f===m}function c(d){let f=d.target;f.removeEventListener("dispose",c);let m=t.get(f);m!==void 0&&(t.delete(f),m.dispose())}function u(d){let f=d.target;f.removeEventListener("dispose",u);let m=e.get(f);m!==void 0&&(e.delete(f),m.dispose())}function h(){t=new WeakMap,e=new WeakMap,n!==null&&(n.dispose(),n=null)}return{get:s,dispose:h}}function JS(i){let t={};function e(n){if(t[n]!==void 0)return t[n];let s=i.getExtension(n);return t[n]=s,s}return{has:function(n){return e(n)!==null},init:function(){e("EXT_color_buffer_float"),e("WEBGL_clip_cull_distance"),e("OES_texture_float_linear"),e("EXT_color_buffer_half_float"),e("WEBGL_multisampled_render_to_texture"),e("WEBGL_render_shared_exponent")},get:function(n){let s=e(n);return s===null&&ya("WebGLRenderer: "+n+" extension not supported."),s}}}function jS(i,t,e,n){let s={},r=new WeakMap,o=new FinalizationRegistry(m=>delete s[m]);function a(m){l(m.target)}function l(m){m.index!==null&&t.remove(m.index);for(let p in m.attributes)t.remove(m.attributes[p]);m.removeEventListener("dispose",a),delete s[m.id],o.unregister(m);let y=r.get(m);y&&(t.remove(y),r.delete(m)),n.releaseStatesOfGeometry(m),m.isInstancedBufferGeometry===!0&&delete m._maxInstanceCount,e.memory.geometries--}function c(m,y){return s[y.id]!==void 0||(y.addEventListener("dispose",a),s[y.id]=new WeakRef(y),o.register(y,y.id,y),e.memory.geometries++),y}function u(m){let y=m.attributes;for(let p in y)t.update(y[p],i.ARRAY_BUFFER)}function h(m){let y=m.index,p=m.attributes.position,g=0;if(p===void 0)return;let v=y!==null?y.array.length:p.array.length/3-1,E=p.count>=65535?Ra:Ca,b=new E(Math.ceil(v/3)*6,1),I=b.array;if(y!==null){let x=y.array;g=y.version;for(let T=0,V=0;T<v;T+=3){let N=x[T+0],L=x[T+1],X=x[T+2];I[V++]=N,I[V++]=L,I[V++]=L,I[V++]=X,I[V++]=X,I[V++]=N}}else{g=p.version;for(let x=0,T=0;x<v;x+=3){let V=x+0,N=x+1,L=x+2;I[T++]=V,I[T++]=N,I[T++]=N,I[T++]=L,I[T++]=L,I[T++]=V}}b.version=g;let A=r.get(m);A&&t.remove(A),r.set(m,b)}function d(m){let y=r.get(m);if(y){let p=m.index;p!==null&&y.version<p.version&&h(m)}else h(m);return r.get(m)}function f(){for(let m in s){let y=s[m].deref();y!==void 0&&l(y)}}return{get:c,update:u,getWireframeAttribute:d,dispose:f}}function QS(i,t,e){let n;function s(h){n=h}let r,o;function a(h){r=h.type,o=h.bytesPerElement}function l(h,d){i.drawElements(n,d,r,h*o),e.update(d,n,1)}function c(h,d,f){f!==0&&(i.drawElementsInstanced(n,d,r,h*o,f),e.update(d,n,f))}function u(h,d,f){if(f===0)return;t.get("WEBGL_multi_draw").multiDrawElementsWEBGL(n,d,0,r,h,0,f);let y=0;for(let p=0;p<f;p++)y+=d[p];e.update(y,n,1)}this.setMode=s,this.setIndex=a,this.render=l,this.renderInstances=c,this.renderMultiDraw=u}function tb(i){let t={geometries:0,textures:0},e={frame:0,calls:0,triangles:0,points:0,lines:0};function n(r,o,a){switch(e.calls++,o){case i.TRIANGLES:e.triangles+=a*(r/3);break;case i.LINES:e.lines+=a*(r/2);break;case i.LINE_STRIP:e.lines+=a*(r-1);break;case i.LINE_LOOP:e.lines+=a*r;break;case i.POINTS:e.points+=a*r;break;default:ee("WebGLInfo: Unknown draw mode:",o);break}}function s(){e.calls=0,e.triangles=0,e.points=0,e.lines=0}return{memory:t,render:e,programs:null,autoReset:!0,reset:s,update:n}}function eb(i,t,e){let n=new WeakMap,s=new Ie;function r(o,a,l){let c=o.morphTargetInfluences,u=a.morphAttributes.position||a.morphAttributes.normal||a.morphAttributes.color,h=u!==void 0?u.length:0,d=n.get(a);if(d===void 0||d.count!==h){let V=function(){x.dispose(),n.delete(a),a.removeEventListener("dispose",V)};d!==void 0&&d.texture.dispose();let f=a.morphAttributes.position!==void 0,m=a.morphAttributes.normal!==void 0,y=a.morphAttributes.color!==void 0,p=a.morphAttributes.position||[],g=a.morphAttributes.normal||[],v=a.morphAttributes.color||[],E=0;f===!0&&(E=1),m===!0&&(E=2),y===!0&&(E=3);let b=a.attributes.position.count*E,I=1;b>t.maxTextureSize&&(I=Math.ceil(b/t.maxTextureSize),b=t.maxTextureSize);let A=new Float32Array(b*I*4*h),x=new Aa(A,b,I,h);x.type=Hi,x.needsUpdate=!0;let T=E*4;for(let N=0;N<h;N++){let L=p[N],X=g[N],q=v[N],D=b*I*4*N;for(let W=0;W<L.count;W++){let J=W*T;f===!0&&(s.fromBufferAttribute(L,W),A[D+J+0]=s.x,A[D+J+1]=s.y,A[D+J+2]=s.z,A[D+J+3]=0),m===!0&&(s.fromBufferAttribute(X,W),A[D+J+4]=s.x,A[D+J+5]=s.y,A[D+J+6]=s.z,A[D+J+7]=0),y===!0&&(s.fromBufferAttribute(q,W),A[D+J+8]=s.x,A[D+J+9]=s.y,A[D+J+10]=s.z,A[D+J+11]=q.itemSize===4?s.w:1)}}d={count:h,texture:x,size:new Zt(b,I)},n.set(a,d),a.addEventListener("dispose",V)}if(o.isInstancedMesh===!0&&o.morphTexture!==null)l.getUniforms().setValue(i,"morphTexture",o.morphTexture,e);else{let f=0;for(let y=0;y<c.length;y++)f+=c[y];let m=a.morphTargetsRelative?1:1-f;l.getUniforms().setValue(i,"morphTargetBaseInfluence",m),l.getUniforms().setValue(i,"morphTargetInfluences",c)}l.getUniforms().setValue(i,"morphTargetsTexture",d.texture,e),l.getUniforms().setValue(i,"morphTargetsTextureSize",d.size)}return{update:r}}function nb(i,t,e,n,s){let r=new WeakMap;function o(c){let u=s.render.frame,h=c.geometry,d=t.get(c,h);if(r.get(d)!==u&&(t.update(d),r.set(d,u)),c.isInstancedMesh&&(c.hasEventListener("dispose",l)===!1&&c.addEventListener("dispose",l),r.get(c)!==u&&(e.update(c.instanceMatrix,i.ARRAY_BUFFER),c.instanceColor!==null&&e.update(c.instanceColor,i.ARRAY_BUFFER),r.set(c,u))),c.isSkinnedMesh){let f=c.skeleton;r.get(f)!==u&&(f.update(),r.set(f,u))}return d}function a(){r=new WeakMap}function l(c){let u=c.target;u.removeEventListener("dispose",l),n.releaseStatesOfObject(u),e.remove(u.instanceMatrix),u.instanceColor!==null&&e.remove(u.instanceColor)}return{update:o,dispose:a}}var ib={[pd]:"LINEAR_TONE_MAPPING",[md]:"REINHARD_TONE_MAPPING",[gd]:"CINEON_TONE_MAPPING",[_d]:"ACES_FILMIC_TONE_MAPPING",[yd]:"AGX_TONE_MAPPING",[vd]:"NEUTRAL_TONE_MAPPING",[xd]:"CUSTOM_TONE_MAPPING"};function sb(i,t,e,n,s,r){let o=new xi(t,e,{type:i,depthBuffer:s,stencilBuffer:r,samples:n?4:0,storeMultisampledDepthBuffer:!1,storeMultisampledStencilBuffer:!1,resolveDepthBuffer:!1,resolveStencilBuffer:!1}),a=null,l=null,c=null,u=new gn;u.setAttribute("position",new sn([-1,3,0,-1,-1,0,3,-1,0],3)),u.setAttribute("uv",new sn([0,2,0,0,2,0],2));let h=new Ac({uniforms:{tDiffuse:{value:null}},vertexShader:`
			precision highp float;

			uniform mat4 modelViewMatrix;
			uniform mat4 projectionMatrix;

			attribute vec3 position;
			attribute vec2 uv;

			varying vec2 vUv;

			void main() {
				vUv = uv;
				gl_Position = projectionMatrix * modelViewMatrix * vec4( position, 1.0 );
			}`,fragmentShader:`
			precision highp float;

			uniform sampler2D tDiffuse;

			varying vec2 vUv;

			#include <tonemapping_pars_fragment>
			#include <colorspace_pars_fragment>

			void main() {
				gl_FragColor = texture2D( tDiffuse, vUv );

				#ifdef LINEAR_TONE_MAPPING
					gl_FragColor.rgb = LinearToneMapping( gl_FragColor.rgb );
				#elif defined( REINHARD_TONE_MAPPING )
					gl_FragColor.rgb = ReinhardToneMapping( gl_FragColor.rgb );
				#elif defined( CINEON_TONE_MAPPING )
					gl_FragColor.rgb = CineonToneMapping( gl_FragColor.rgb );
				#elif defined( ACES_FILMIC_TONE_MAPPING )
					gl_FragColor.rgb = ACESFilmicToneMapping( gl_FragColor.rgb );
				#elif defined( AGX_TONE_MAPPING )
					gl_FragColor.rgb = AgXToneMapping( gl_FragColor.rgb );
				#elif defined( NEUTRAL_TONE_MAPPING )
					gl_FragColor.rgb = NeutralToneMapping( gl_FragColor.rgb );
				#elif defined( CUSTOM_TONE_MAPPING )
					gl_FragColor.rgb = CustomToneMapping( gl_FragColor.rgb );
				#endif

				#ifdef SRGB_TRANSFER
					gl_FragColor = sRGBTransferOETF( gl_FragColor );
				#endif
			}`,depthTest:!1,depthWrite:!1}),d=new Sn(u,h),f=new Fa(-1,1,1,-1,0,1),m=null,y=null,p=!1,g,v=null,E=[],b=!1;this.setSize=function(I,A){o.setSize(I,A),a!==null&&a.setSize(I,A),l!==null&&l.setSize(I,A);for(let x=0;x<E.length;x++){let T=E[x];T.setSize&&T.setSize(I,A)}},this.setEffects=function(I){E=I,b=E.length>0&&E[0].isRenderPass===!0;let A=o.width,x=o.height;E.length>0&&a===null&&(a=new xi(A,x,{type:Wi,depthBuffer:!1,stencilBuffer:!1}),l=new xi(A,x,{type:Wi,depthBuffer:!1,stencilBuffer:!1}));let T=s===!0&&E.some(V=>V.needsDepthTexture===!0);T!==(o.depthTexture!==null)&&(T===!0&&c===null&&(c=new Ds(A,x),r===!0&&(c.format=Os,c.type=Rr)),o.dispose(),o.depthTexture=T?c:null,o.resolveDepthBuffer=T,o.storeMultisampledDepthBuffer=T);for(let V=0;V<E.length;V++){let N=E[V];N.setSize&&N.setSize(A,x),T&&N.needsDepthTexture===!0&&N.setDepthTexture&&N.setDepthTexture(c)}},this.begin=function(I,A){if(p||I.toneMapping===us&&E.length===0)return!1;if(v=A,A!==null){let x=A.width,T=A.height;(o.width!==x||o.height!==T)&&this.setSize(x,T)}return b===!1&&I.setRenderTarget(o),g=I.toneMapping,I.toneMapping=us,!0},this.hasRenderPass=function(){return b},this.end=function(I,A){I.toneMapping=g,p=!0;let x=o,T=a;for(let V=0;V<E.length;V++){let N=E[V];N.enabled!==!1&&(N.render(I,T,x,A),N.needsSwap!==!1&&(x=T,T=T===a?l:a))}if(m!==I.outputColorSpace||y!==I.toneMapping){m=I.outputColorSpace,y=I.toneMapping,h.defines={},ye.getTransfer(m)===Re&&(h.defines.SRGB_TRANSFER="");let V=ib[y];V&&(h.defines[V]=""),h.needsUpdate=!0}h.uniforms.tDiffuse.value=x.texture,I.setRenderTarget(v),I.render(d,f),v=null,p=!1},this.isCompositing=function(){return p},this.dispose=function(){o.dispose(),a!==null&&a.dispose(),l!==null&&l.dispose(),u.dispose(),h.dispose()}}var _g=new ei,xg=new Ds(1,1),yg=new Pa(1),vg=new Aa,Sg=new vc,bg=new Ia,Zm=[],Jm=[],jm=new Float32Array(16),Qm=new Float32Array(9),tg=new Float32Array(4);function Go(i,t,e){let n=i[0];if(n<=0||n>0)return i;let s=t*e,r=Zm[s];if(r===void 0&&(r=new Float32Array(s),Zm[s]=r),t!==0){n.toArray(r,0);for(let o=1,a=0;o!==t;++o)a+=e,i[o].toArray(r,a)}return r}function bn(i,t){if(i.length!==t.length)return!1;for(let e=0,n=i.length;e<n;e++)if(i[e]!==t[e])return!1;return!0}function Mn(i,t){for(let e=0,n=t.length;e<n;e++)i[e]=t[e]}function Dh(i,t){let e=Jm[t];e===void 0&&(e=new Int32Array(t),Jm[t]=e);for(let n=0;n!==t;++n)e[n]=i.allocateTextureUnit();return e}function rb(i,t){let e=this.cache;e[0]!==t&&(i.uniform1f(this.addr,t),e[0]=t)}function ob(i,t){let e=this.cache;if(t.x!==void 0)(e[0]!==t.x||e[1]!==t.y)&&(i.uniform2f(this.addr,t.x,t.y),e[0]=t.x,e[1]=t.y);else{if(bn(e,t))return;i.uniform2fv(this.addr,t),Mn(e,t)}}function ab(i,t){let e=this.cache;if(t.x!==void 0)(e[0]!==t.x||e[1]!==t.y||e[2]!==t.z)&&(i.uniform3f(this.addr,t.x,t.y,t.z),e[0]=t.x,e[1]=t.y,e[2]=t.z);else if(t.r!==void 0)(e[0]!==t.r||e[1]!==t.g||e[2]!==t.b)&&(i.uniform3f(this.addr,t.r,t.g,t.b),e[0]=t.r,e[1]=t.g,e[2]=t.b);else{if(bn(e,t))return;i.uniform3fv(this.addr,t),Mn(e,t)}}function lb(i,t){let e=this.cache;if(t.x!==void 0)(e[0]!==t.x||e[1]!==t.y||e[2]!==t.z||e[3]!==t.w)&&(i.uniform4f(this.addr,t.x,t.y,t.z,t.w),e[0]=t.x,e[1]=t.y,e[2]=t.z,e[3]=t.w);else{if(bn(e,t))return;i.uniform4fv(this.addr,t),Mn(e,t)}}function cb(i,t){let e=this.cache,n=t.elements;if(n===void 0){if(bn(e,t))return;i.uniformMatrix2fv(this.addr,!1,t),Mn(e,t)}else{if(bn(e,n))return;tg.set(n),i.uniformMatrix2fv(this.addr,!1,tg),Mn(e,n)}}function hb(i,t){let e=this.cache,n=t.elements;if(n===void 0){if(bn(e,t))return;i.uniformMatrix3fv(this.addr,!1,t),Mn(e,t)}else{if(bn(e,n))return;Qm.set(n),i.uniformMatrix3fv(this.addr,!1,Qm),Mn(e,n)}}function ub(i,t){let e=this.cache,n=t.elements;if(n===void 0){if(bn(e,t))return;i.uniformMatrix4fv(this.addr,!1,t),Mn(e,t)}else{if(bn(e,n))return;jm.set(n),i.uniformMatrix4fv(this.addr,!1,jm),Mn(e,n)}}function db(i,t){let e=this.cache;e[0]!==t&&(i.uniform1i(this.addr,t),e[0]=t)}function fb(i,t){let e=this.cache;if(t.x!==void 0)(e[0]!==t.x||e[1]!==t.y)&&(i.uniform2i(this.addr,t.x,t.y),e[0]=t.x,e[1]=t.y);else{if(bn(e,t))return;i.uniform2iv(this.addr,t),Mn(e,t)}}function pb(i,t){let e=this.cache;if(t.x!==void 0)(e[0]!==t.x||e[1]!==t.y||e[2]!==t.z)&&(i.uniform3i(this.addr,t.x,t.y,t.z),e[0]=t.x,e[1]=t.y,e[2]=t.z);else{if(bn(e,t))return;i.uniform3iv(this.addr,t),Mn(e,t)}}function mb(i,t){let e=this.cache;if(t.x!==void 0)(e[0]!==t.x||e[1]!==t.y||e[2]!==t.z||e[3]!==t.w)&&(i.uniform4i(this.addr,t.x,t.y,t.z,t.w),e[0]=t.x,e[1]=t.y,e[2]=t.z,e[3]=t.w);else{if(bn(e,t))return;i.uniform4iv(this.addr,t),Mn(e,t)}}function gb(i,t){let e=this.cache;e[0]!==t&&(i.uniform1ui(this.addr,t),e[0]=t)}function _b(i,t){let e=this.cache;if(t.x!==void 0)(e[0]!==t.x||e[1]!==t.y)&&(i.uniform2ui(this.addr,t.x,t.y),e[0]=t.x,e[1]=t.y);else{if(bn(e,t))return;i.uniform2uiv(this.addr,t),Mn(e,t)}}function xb(i,t){let e=this.cache;if(t.x!==void 0)(e[0]!==t.x||e[1]!==t.y||e[2]!==t.z)&&(i.uniform3ui(this.addr,t.x,t.y,t.z),e[0]=t.x,e[1]=t.y,e[2]=t.z);else{if(bn(e,t))return;i.uniform3uiv(this.addr,t),Mn(e,t)}}function yb(i,t){let e=this.cache;if(t.x!==void 0)(e[0]!==t.x||e[1]!==t.y||e[2]!==t.z||e[3]!==t.w)&&(i.uniform4ui(this.addr,t.x,t.y,t.z,t.w),e[0]=t.x,e[1]=t.y,e[2]=t.z,e[3]=t.w);else{if(bn(e,t))return;i.uniform4uiv(this.addr,t),Mn(e,t)}}function Nh(i){return i.version===0&&(i.compareFunction=Pd,i.needsUpdate=!0),i}function vb(i,t,e){let n=this.cache,s=e.allocateTextureUnit();n[0]!==s&&(i.uniform1i(this.addr,s),n[0]=s);let r;this.type===i.SAMPLER_2D_SHADOW?r=Nh(xg):r=_g,e.setTexture2D(t||r,s)}function Sb(i,t,e){let n=this.cache,s=e.allocateTextureUnit();n[0]!==s&&(i.uniform1i(this.addr,s),n[0]=s),e.setTexture3D(t||Sg,s)}function bb(i,t,e){let n=this.cache,s=e.allocateTextureUnit();n[0]!==s&&(i.uniform1i(this.addr,s),n[0]=s);let r;this.type===i.SAMPLER_CUBE_SHADOW?r=Nh(yg):r=bg,e.setTextureCube(t||r,s)}function Mb(i,t,e){let n=this.cache,s=e.allocateTextureUnit();n[0]!==s&&(i.uniform1i(this.addr,s),n[0]=s),e.setTexture2DArray(t||vg,s)}function wb(i){switch(i){case 5126:return rb;case 35664:return ob;case 35665:return ab;case 35666:return lb;case 35674:return cb;case 35675:return hb;case 35676:return ub;case 5124:case 35670:return db;case 35667:case 35671:return fb;case 35668:case 35672:return pb;case 35669:case 35673:return mb;case 5125:return gb;case 36294:return _b;case 36295:return xb;case 36296:return yb;case 35678:case 36198:case 36298:case 36306:case 35682:return vb;case 35679:case 36299:case 36307:return Sb;case 35680:case 36300:case 36308:case 36293:return bb;case 36289:case 36303:case 36311:case 36292:return Mb}}function Tb(i,t){i.uniform1fv(this.addr,t)}function Ab(i,t){let e=Go(t,this.size,2);i.uniform2fv(this.addr,e)}function Eb(i,t){let e=Go(t,this.size,3);i.uniform3fv(this.addr,e)}function Cb(i,t){let e=Go(t,this.size,4);i.uniform4fv(this.addr,e)}function Rb(i,t){let e=Go(t,this.size,4);i.uniformMatrix2fv(this.addr,!1,e)}function Ib(i,t){let e=Go(t,this.size,9);i.uniformMatrix3fv(this.addr,!1,e)}function Pb(i,t){let e=Go(t,this.size,16);i.uniformMatrix4fv(this.addr,!1,e)}function Lb(i,t){i.uniform1iv(this.addr,t)}function Db(i,t){i.uniform2iv(this.addr,t)}function Nb(i,t){i.uniform3iv(this.addr,t)}function Ub(i,t){i.uniform4iv(this.addr,t)}function Ob(i,t){i.uniform1uiv(this.addr,t)}function Fb(i,t){i.uniform2uiv(this.addr,t)}function Bb(i,t){i.uniform3uiv(this.addr,t)}function kb(i,t){i.uniform4uiv(this.addr,t)}function zb(i,t,e){let n=this.cache,s=t.length,r=Dh(e,s);bn(n,r)||(i.uniform1iv(this.addr,r),Mn(n,r));let o;this.type===i.SAMPLER_2D_SHADOW?o=Nh(xg):o=_g;for(let a=0;a!==s;++a)e.setTexture2D(t[a]||o,r[a])}function Vb(i,t,e){let n=this.cache,s=t.length,r=Dh(e,s);bn(n,r)||(i.uniform1iv(this.addr,r),Mn(n,r));for(let o=0;o!==s;++o)e.setTexture3D(t[o]||Sg,r[o])}function Gb(i,t,e){let n=this.cache,s=t.length,r=Dh(e,s);bn(n,r)||(i.uniform1iv(this.addr,r),Mn(n,r));let o;this.type===i.SAMPLER_CUBE_SHADOW?o=Nh(yg):o=bg;for(let a=0;a!==s;++a)e.setTextureCube(t[a]||o,r[a])}function Hb(i,t,e){let n=this.cache,s=t.length,r=Dh(e,s);bn(n,r)||(i.uniform1iv(this.addr,r),Mn(n,r));for(let o=0;o!==s;++o)e.setTexture2DArray(t[o]||vg,r[o])}function Wb(i){switch(i){case 5126:return Tb;case 35664:return Ab;case 35665:return Eb;case 35666:return Cb;case 35674:return Rb;case 35675:return Ib;case 35676:return Pb;case 5124:case 35670:return Lb;case 35667:case 35671:return Db;case 35668:case 35672:return Nb;case 35669:case 35673:return Ub;case 5125:return Ob;case 36294:return Fb;case 36295:return Bb;case 36296:return kb;case 35678:case 36198:case 36298:case 36306:case 35682:return zb;case 35679:case 36299:case 36307:return Vb;case 35680:case 36300:case 36308:case 36293:return Gb;case 36289:case 36303:case 36311:case 36292:return Hb}}var Wd=class{constructor(t,e,n){this.id=t,this.addr=n,this.cache=[],this.type=e.type,this.setValue=wb(e.type)}},Xd=class{constructor(t,e,n){this.id=t,this.addr=n,this.cache=[],this.type=e.type,this.size=e.size,this.setValue=Wb(e.type)}},qd=class{constructor(t){this.id=t,this.seq=[],this.map={}}setValue(t,e,n){let s=this.seq;for(let r=0,o=s.length;r!==o;++r){let a=s[r];a.setValue(t,e[a.id],n)}}},Gd=/(\w+)(\])?(\[|\.)?/g;function eg(i,t){i.seq.push(t),i.map[t.id]=t}function Xb(i,t,e){let n=i.name,s=n.length;for(Gd.lastIndex=0;;){let r=Gd.exec(n),o=Gd.lastIndex,a=r[1],l=r[2]==="]",c=r[3];if(l&&(a=a|0),c===void 0||c==="["&&o+2===s){eg(e,c===void 0?new Wd(a,i,t):new Xd(a,i,t));break}else{let h=e.map[a];h===void 0&&(h=new qd(a),eg(e,h)),e=h}}}var Vo=class{constructor(t,e){this.seq=[],this.map={};let n=t.getProgramParameter(e,t.ACTIVE_UNIFORMS);for(let o=0;o<n;++o){let a=t.getActiveUniform(e,o),l=t.getUniformLocation(e,a.name);Xb(a,l,this)}let s=[],r=[];for(let o of this.seq)o.type===t.SAMPLER_2D_SHADOW||o.type===t.SAMPLER_CUBE_SHADOW||o.type===t.SAMPLER_2D_ARRAY_SHADOW?s.push(o):r.push(o);s.length>0&&(this.seq=s.concat(r))}setValue(t,e,n,s){let r=this.map[e];r!==void 0&&r.setValue(t,n,s)}setOptional(t,e,n){let s=e[n];s!==void 0&&this.setValue(t,n,s)}static upload(t,e,n,s){for(let r=0,o=e.length;r!==o;++r){let a=e[r],l=n[a.id];l.needsUpdate!==!1&&a.setValue(t,l.value,s)}}static seqWithValue(t,e){let n=[];for(let s=0,r=t.length;s!==r;++s){let o=t[s];o.id in e&&n.push(o)}return n}};function ng(i,t,e){let n=i.createShader(t);return i.shaderSource(n,e),i.compileShader(n),n}var qb=37297,Yb=0;function $b(i,t){let e=i.split(`
`),n=[],s=Math.max(t-6,0),r=Math.min(t+6,e.length);for(let o=s;o<r;o++){let a=o+1;n.push(`${a===t?">":" "} ${a}: ${e[o]}`)}return n.join(`
`)}var ig=new ie;function Kb(i){ye._getMatrix(ig,ye.workingColorSpace,i);let t=`mat3( ${ig.elements.map(e=>e.toFixed(4))} )`;switch(ye.getTransfer(i)){case Ma:return[t,"LinearTransferOETF"];case Re:return[t,"sRGBTransferOETF"];default:return $t("WebGLProgram: Unsupported color space: ",i),[t,"LinearTransferOETF"]}}function sg(i,t,e){let n=i.getShaderParameter(t,i.COMPILE_STATUS),r=(i.getShaderInfoLog(t)||"").trim();if(n&&r==="")return"";let o=/ERROR: 0:(\d+)/.exec(r);if(o){let a=parseInt(o[1]);return e.toUpperCase()+`

`+r+`

`+$b(i.getShaderSource(t),a)}else return r}function Zb(i,t){let e=Kb(t);return[`vec4 ${i}( vec4 value ) {`,`	return ${e[1]}( vec4( ${e[0]} * value.rgb, value.a ) );`,"}"].join(`
`)}var Jb={[pd]:"Linear",[md]:"Reinhard",[gd]:"Cineon",[_d]:"ACESFilmic",[yd]:"AgX",[vd]:"Neutral",[xd]:"Custom"};function jb(i,t){let e=Jb[t];return e===void 0?($t("WebGLProgram: Unsupported toneMapping:",t),"vec3 "+i+"( vec3 color ) { return LinearToneMapping( color ); }"):"vec3 "+i+"( vec3 color ) { return "+e+"ToneMapping( color ); }"}var Ih=new k;function Qb(){ye.getLuminanceCoefficients(Ih);let i=Ih.x.toFixed(4),t=Ih.y.toFixed(4),e=Ih.z.toFixed(4);return["float luminance( const in vec3 rgb ) {",`	const vec3 weights = vec3( ${i}, ${t}, ${e} );`,"	return dot( weights, rgb );","}"].join(`
`)}function tM(i){return[i.extensionClipCullDistance?"#extension GL_ANGLE_clip_cull_distance : require":"",i.extensionMultiDraw?"#extension GL_ANGLE_multi_draw : require":""].filter(el).join(`
`)}function eM(i){let t=[];for(let e in i){let n=i[e];n!==!1&&t.push("#define "+e+" "+n)}return t.join(`
`)}function nM(i,t){let e={},n=i.getProgramParameter(t,i.ACTIVE_ATTRIBUTES);for(let s=0;s<n;s++){let r=i.getActiveAttrib(t,s),o=r.name,a=1;r.type===i.FLOAT_MAT2&&(a=2),r.type===i.FLOAT_MAT3&&(a=3),r.type===i.FLOAT_MAT4&&(a=4),e[o]={type:r.type,location:i.getAttribLocation(t,o),locationSize:a}}return e}function el(i){return i!==""}function rg(i,t){let e=t.numSpotLightShadows+t.numSpotLightMaps-t.numSpotLightShadowsWithMaps;return i.replace(/NUM_SUN_LIGHTS/g,t.numSunLights).replace(/NUM_DIR_LIGHTS/g,t.numDirLights).replace(/NUM_SPOT_LIGHTS/g,t.numSpotLights).replace(/NUM_SPOT_LIGHT_MAPS/g,t.numSpotLightMaps).replace(/NUM_SPOT_LIGHT_COORDS/g,e).replace(/NUM_RECT_AREA_LIGHTS/g,t.numRectAreaLights).replace(/NUM_POINT_LIGHTS/g,t.numPointLights).replace(/NUM_HEMI_LIGHTS/g,t.numHemiLights).replace(/NUM_SUN_LIGHT_SHADOWS/g,t.numSunLightShadows).replace(/NUM_DIR_LIGHT_SHADOWS/g,t.numDirLightShadows).replace(/NUM_SPOT_LIGHT_SHADOWS_WITH_MAPS/g,t.numSpotLightShadowsWithMaps).replace(/NUM_SPOT_LIGHT_SHADOWS/g,t.numSpotLightShadows).replace(/NUM_POINT_LIGHT_SHADOWS/g,t.numPointLightShadows).replace(/NUM_LIGHT_PROBE_GRIDS/g,t.numLightProbeGrids)}function og(i,t){return i.replace(/NUM_CLIPPING_PLANES/g,t.numClippingPlanes).replace(/UNION_CLIPPING_PLANES/g,t.numClippingPlanes-t.numClipIntersection)}var iM=/^[ \t]*#include +<([\w\d./]+)>/gm;function Yd(i){return i.replace(iM,sM)}function sM(i,t){let e=fe[t];if(e===void 0)throw new Error("THREE.WebGLProgram: Can not resolve #include <"+t+">");return Yd(e)}var rM=/#pragma unroll_loop_start\s+for\s*\(\s*int\s+i\s*=\s*(\d+)\s*;\s*i\s*<\s*(\d+)\s*;\s*i\s*\+\+\s*\)\s*{([\s\S]+?)}\s+#pragma unroll_loop_end/g;function ag(i){return i.replace(rM,oM)}function oM(i,t,e,n){let s="";for(let r=parseInt(t);r<parseInt(e);r++)s+=n.replace(/\[\s*i\s*\]/g,"[ "+r+" ]").replace(/UNROLLED_LOOP_INDEX/g,r);return s}function lg(i){let t=`precision ${i.precision} float;
	precision ${i.precision} int;
	precision ${i.precision} sampler2D;
	precision ${i.precision} samplerCube;
	precision ${i.precision} sampler3D;
	precision ${i.precision} sampler2DArray;
	precision ${i.precision} sampler2DShadow;
	precision ${i.precision} samplerCubeShadow;
	precision ${i.precision} sampler2DArrayShadow;
	precision ${i.precision} isampler2D;
	precision ${i.precision} isampler3D;
	precision ${i.precision} isamplerCube;
	precision ${i.precision} isampler2DArray;
	precision ${i.precision} usampler2D;
	precision ${i.precision} usampler3D;
	precision ${i.precision} usamplerCube;
	precision ${i.precision} usampler2DArray;
	`;return i.precision==="highp"?t+=`
#define HIGH_PRECISION`:i.precision==="mediump"?t+=`
#define MEDIUM_PRECISION`:i.precision==="lowp"&&(t+=`
#define LOW_PRECISION`),t}var aM={[Wa]:"SHADOWMAP_TYPE_PCF",[Fo]:"SHADOWMAP_TYPE_VSM"};function lM(i){return aM[i.shadowMapType]||"SHADOWMAP_TYPE_BASIC"}var cM={[ko]:"ENVMAP_MODE_REFRACTION"};function hM(i){return i.envMap===!1?"ENVMAP_MODE_REFLECTION":cM[i.envMapMode]||"ENVMAP_MODE_REFLECTION"}var uM={[Vc]:"ENVMAP_BLENDING_MULTIPLY",[Cm]:"ENVMAP_BLENDING_MIX",[Rm]:"ENVMAP_BLENDING_ADD"};function dM(i){return i.envMap===!1?"ENVMAP_BLENDING_NONE":uM[i.combine]||"ENVMAP_BLENDING_NONE"}function fM(i,t,e,n){let s=i.getContext(),r=e.defines,o=e.vertexShader,a=e.fragmentShader,l=lM(e),c=e.envMapPMREM===!0?"ENVMAP_TYPE_PMREM":"ENVMAP_TYPE_CUBE",u=hM(e),h=dM(e),d=tM(e),f=eM(r),m=s.createProgram(),y,p,g=e.glslVersion?"#version "+e.glslVersion+`
`:"";e.isRawShaderMaterial?(y=["#define SHADER_TYPE "+e.shaderType,"#define SHADER_NAME "+e.shaderName,f].filter(el).join(`
`),y.length>0&&(y+=`
`),p=["#define SHADER_TYPE "+e.shaderType,"#define SHADER_NAME "+e.shaderName,f].filter(el).join(`
`),p.length>0&&(p+=`
`)):(y=[lg(e),"#define SHADER_TYPE "+e.shaderType,"#define SHADER_NAME "+e.shaderName,f,e.extensionClipCullDistance?"#define USE_CLIP_DISTANCE":"",e.batching?"#define USE_BATCHING":"",e.batchingColor?"#define USE_BATCHING_COLOR":"",e.instancing?"#define USE_INSTANCING":"",e.instancingColor?"#define USE_INSTANCING_COLOR":"",e.instancingMorph?"#define USE_INSTANCING_MORPH":"",e.useFog&&e.fog?"#define USE_FOG":"",e.useFog&&e.fogExp2?"#define FOG_EXP2":"",e.map?"#define USE_MAP":"",e.envMap?"#define USE_ENVMAP":"",e.envMap?"#define "+u:"",e.lightMap?"#define USE_LIGHTMAP":"",e.aoMap?"#define USE_AOMAP":"",e.bumpMap?"#define USE_BUMPMAP":"",e.normalMap?"#define USE_NORMALMAP":"",e.normalMapObjectSpace?"#define USE_NORMALMAP_OBJECTSPACE":"",e.normalMapTangentSpace?"#define USE_NORMALMAP_TANGENTSPACE":"",e.displacementMap?"#define USE_DISPLACEMENTMAP":"",e.emissiveMap?"#define USE_EMISSIVEMAP":"",e.anisotropy?"#define USE_ANISOTROPY":"",e.anisotropyMap?"#define USE_ANISOTROPYMAP":"",e.clearcoatMap?"#define USE_CLEARCOATMAP":"",e.clearcoatRoughnessMap?"#define USE_CLEARCOAT_ROUGHNESSMAP":"",e.clearcoatNormalMap?"#define USE_CLEARCOAT_NORMALMAP":"",e.diffuseRoughnessMap?"#define USE_DIFFUSE_ROUGHNESSMAP":"",e.iridescenceMap?"#define USE_IRIDESCENCEMAP":"",e.iridescenceThicknessMap?"#define USE_IRIDESCENCE_THICKNESSMAP":"",e.specularMap?"#define USE_SPECULARMAP":"",e.specularColorMap?"#define USE_SPECULAR_COLORMAP":"",e.specularIntensityMap?"#define USE_SPECULAR_INTENSITYMAP":"",e.roughnessMap?"#define USE_ROUGHNESSMAP":"",e.metalnessMap?"#define USE_METALNESSMAP":"",e.alphaMap?"#define USE_ALPHAMAP":"",e.alphaHash?"#define USE_ALPHAHASH":"",e.transmission?"#define USE_TRANSMISSION":"",e.transmissionMap?"#define USE_TRANSMISSIONMAP":"",e.thicknessMap?"#define USE_THICKNESSMAP":"",e.sheenColorMap?"#define USE_SHEEN_COLORMAP":"",e.sheenRoughnessMap?"#define USE_SHEEN_ROUGHNESSMAP":"",e.mapUv?"#define MAP_UV "+e.mapUv:"",e.alphaMapUv?"#define ALPHAMAP_UV "+e.alphaMapUv:"",e.lightMapUv?"#define LIGHTMAP_UV "+e.lightMapUv:"",e.aoMapUv?"#define AOMAP_UV "+e.aoMapUv:"",e.emissiveMapUv?"#define EMISSIVEMAP_UV "+e.emissiveMapUv:"",e.bumpMapUv?"#define BUMPMAP_UV "+e.bumpMapUv:"",e.normalMapUv?"#define NORMALMAP_UV "+e.normalMapUv:"",e.displacementMapUv?"#define DISPLACEMENTMAP_UV "+e.displacementMapUv:"",e.metalnessMapUv?"#define METALNESSMAP_UV "+e.metalnessMapUv:"",e.roughnessMapUv?"#define ROUGHNESSMAP_UV "+e.roughnessMapUv:"",e.anisotropyMapUv?"#define ANISOTROPYMAP_UV "+e.anisotropyMapUv:"",e.clearcoatMapUv?"#define CLEARCOATMAP_UV "+e.clearcoatMapUv:"",e.clearcoatNormalMapUv?"#define CLEARCOAT_NORMALMAP_UV "+e.clearcoatNormalMapUv:"",e.clearcoatRoughnessMapUv?"#define CLEARCOAT_ROUGHNESSMAP_UV "+e.clearcoatRoughnessMapUv:"",e.diffuseRoughnessMapUv?"#define DIFFUSE_ROUGHNESSMAP_UV "+e.diffuseRoughnessMapUv:"",e.iridescenceMapUv?"#define IRIDESCENCEMAP_UV "+e.iridescenceMapUv:"",e.iridescenceThicknessMapUv?"#define IRIDESCENCE_THICKNESSMAP_UV "+e.iridescenceThicknessMapUv:"",e.sheenColorMapUv?"#define SHEEN_COLORMAP_UV "+e.sheenColorMapUv:"",e.sheenRoughnessMapUv?"#define SHEEN_ROUGHNESSMAP_UV "+e.sheenRoughnessMapUv:"",e.specularMapUv?"#define SPECULARMAP_UV "+e.specularMapUv:"",e.specularColorMapUv?"#define SPECULAR_COLORMAP_UV "+e.specularColorMapUv:"",e.specularIntensityMapUv?"#define SPECULAR_INTENSITYMAP_UV "+e.specularIntensityMapUv:"",e.transmissionMapUv?"#define TRANSMISSIONMAP_UV "+e.transmissionMapUv:"",e.thicknessMapUv?"#define THICKNESSMAP_UV "+e.thicknessMapUv:"",e.vertexTangents&&e.flatShading===!1?"#define USE_TANGENT":"",e.vertexNormals?"#define HAS_NORMAL":"",e.vertexColors?"#define USE_COLOR":"",e.vertexAlphas?"#define USE_COLOR_ALPHA":"",e.vertexUv1s?"#define USE_UV1":"",e.vertexUv2s?"#define USE_UV2":"",e.vertexUv3s?"#define USE_UV3":"",e.pointsUvs?"#define USE_POINTS_UV":"",e.flatShading?"#define FLAT_SHADED":"",e.skinning?"#define USE_SKINNING":"",e.morphTargets?"#define USE_MORPHTARGETS":"",e.morphNormals&&e.flatShading===!1?"#define USE_MORPHNORMALS":"",e.morphColors?"#define USE_MORPHCOLORS":"",e.morphTargetsCount>0?"#define MORPHTARGETS_TEXTURE_STRIDE "+e.morphTextureStride:"",e.morphTargetsCount>0?"#define MORPHTARGETS_COUNT "+e.morphTargetsCount:"",e.doubleSided?"#define DOUBLE_SIDED":"",e.flipSided?"#define FLIP_SIDED":"",e.shadowMapEnabled?"#define USE_SHADOWMAP":"",e.shadowMapEnabled?"#define "+l:"",e.sizeAttenuation?"#define USE_SIZEATTENUATION":"",e.numLightProbes>0?"#define USE_LIGHT_PROBES":"",e.logarithmicDepthBuffer?"#define USE_LOGARITHMIC_DEPTH_BUFFER":"",e.reversedDepthBuffer?"#define USE_REVERSED_DEPTH_BUFFER":"","uniform mat4 modelMatrix;","uniform mat4 modelViewMatrix;","uniform mat4 projectionMatrix;","uniform mat4 viewMatrix;","uniform mat3 normalMatrix;","uniform vec3 cameraPosition;","uniform bool isOrthographic;","#ifdef USE_INSTANCING","	attribute mat4 instanceMatrix;","#endif","#ifdef USE_INSTANCING_COLOR","	attribute vec3 instanceColor;","#endif","#ifdef USE_INSTANCING_MORPH","	uniform sampler2D morphTexture;","#endif","attribute vec3 position;","attribute vec3 normal;","attribute vec2 uv;","#ifdef USE_UV1","	attribute vec2 uv1;","#endif","#ifdef USE_UV2","	attribute vec2 uv2;","#endif","#ifdef USE_UV3","	attribute vec2 uv3;","#endif","#ifdef USE_TANGENT","	attribute vec4 tangent;","#endif","#if defined( USE_COLOR_ALPHA )","	attribute vec4 color;","#elif defined( USE_COLOR )","	attribute vec3 color;","#endif","#ifdef USE_SKINNING","	attribute vec4 skinIndex;","	attribute vec4 skinWeight;","#endif",`
`].filter(el).join(`
`),p=[lg(e),"#define SHADER_TYPE "+e.shaderType,"#define SHADER_NAME "+e.shaderName,f,e.useFog&&e.fog?"#define USE_FOG":"",e.useFog&&e.fogExp2?"#define FOG_EXP2":"",e.alphaToCoverage?"#define ALPHA_TO_COVERAGE":"",e.map?"#define USE_MAP":"",e.matcap?"#define USE_MATCAP":"",e.envMap?"#define USE_ENVMAP":"",e.envMap?"#define "+c:"",e.envMap?"#define "+u:"",e.envMap?"#define "+h:"",e.envMapPMREM?"#define ENVMAP_MAX_LOD "+e.envMapMaxLod+".0":"",e.envMapPMREM?"#define ENVMAP_SIZE "+e.envMapSize+".0":"",e.lightMap?"#define USE_LIGHTMAP":"",e.aoMap?"#define USE_AOMAP":"",e.bumpMap?"#define USE_BUMPMAP":"",e.normalMap?"#define USE_NORMALMAP":"",e.normalMapObjectSpace?"#define USE_NORMALMAP_OBJECTSPACE":"",e.normalMapTangentSpace?"#define USE_NORMALMAP_TANGENTSPACE":"",e.packedNormalMap?"#define USE_PACKED_NORMALMAP":"",e.emissiveMap?"#define USE_EMISSIVEMAP":"",e.anisotropy?"#define USE_ANISOTROPY":"",e.anisotropyMap?"#define USE_ANISOTROPYMAP":"",e.clearcoat?"#define USE_CLEARCOAT":"",e.clearcoatMap?"#define USE_CLEARCOATMAP":"",e.clearcoatRoughnessMap?"#define USE_CLEARCOAT_ROUGHNESSMAP":"",e.clearcoatNormalMap?"#define USE_CLEARCOAT_NORMALMAP":"",e.diffuseRoughness?"#define USE_DIFFUSE_ROUGHNESS":"",e.diffuseRoughnessMap?"#define USE_DIFFUSE_ROUGHNESSMAP":"",e.dispersion?"#define USE_DISPERSION":"",e.retroreflection?"#define USE_RETROREFLECTION":"",e.iridescence?"#define USE_IRIDESCENCE":"",e.iridescenceMap?"#define USE_IRIDESCENCEMAP":"",e.iridescenceThicknessMap?"#define USE_IRIDESCENCE_THICKNESSMAP":"",e.specularMap?"#define USE_SPECULARMAP":"",e.specularColorMap?"#define USE_SPECULAR_COLORMAP":"",e.specularIntensityMap?"#define USE_SPECULAR_INTENSITYMAP":"",e.roughnessMap?"#define USE_ROUGHNESSMAP":"",e.metalnessMap?"#define USE_METALNESSMAP":"",e.alphaMap?"#define USE_ALPHAMAP":"",e.alphaTest?"#define USE_ALPHATEST":"",e.alphaHash?"#define USE_ALPHAHASH":"",e.sheen?"#define USE_SHEEN":"",e.sheenColorMap?"#define USE_SHEEN_COLORMAP":"",e.sheenRoughnessMap?"#define USE_SHEEN_ROUGHNESSMAP":"",e.transmission?"#define USE_TRANSMISSION":"",e.transmissionMap?"#define USE_TRANSMISSIONMAP":"",e.thicknessMap?"#define USE_THICKNESSMAP":"",e.vertexTangents&&e.flatShading===!1?"#define USE_TANGENT":"",e.vertexColors||e.instancingColor?"#define USE_COLOR":"",e.vertexAlphas||e.batchingColor?"#define USE_COLOR_ALPHA":"",e.vertexUv1s?"#define USE_UV1":"",e.vertexUv2s?"#define USE_UV2":"",e.vertexUv3s?"#define USE_UV3":"",e.pointsUvs?"#define USE_POINTS_UV":"",e.gradientMap?"#define USE_GRADIENTMAP":"",e.flatShading?"#define FLAT_SHADED":"",e.doubleSided?"#define DOUBLE_SIDED":"",e.flipSided?"#define FLIP_SIDED":"",e.shadowMapEnabled?"#define USE_SHADOWMAP":"",e.shadowMapEnabled?"#define "+l:"",e.premultipliedAlpha?"#define PREMULTIPLIED_ALPHA":"",e.numLightProbes>0?"#define USE_LIGHT_PROBES":"",e.decodeVideoTexture?"#define DECODE_VIDEO_TEXTURE":"",e.decodeVideoTextureEmissive?"#define DECODE_VIDEO_TEXTURE_EMISSIVE":"",e.logarithmicDepthBuffer?"#define USE_LOGARITHMIC_DEPTH_BUFFER":"",e.reversedDepthBuffer?"#define USE_REVERSED_DEPTH_BUFFER":"","uniform mat4 viewMatrix;","uniform vec3 cameraPosition;","uniform bool isOrthographic;",e.toneMapping!==us?"#define TONE_MAPPING":"",e.toneMapping!==us?fe.tonemapping_pars_fragment:"",e.toneMapping!==us?jb("toneMapping",e.toneMapping):"",e.dithering?"#define DITHERING":"",e.opaque?"#define OPAQUE":"",fe.colorspace_pars_fragment,Zb("linearToOutputTexel",e.outputColorSpace),Qb(),e.useDepthPacking?"#define DEPTH_PACKING "+e.depthPacking:"",`
`].filter(el).join(`
`)),o=Yd(o),o=rg(o,e),o=og(o,e),a=Yd(a),a=rg(a,e),a=og(a,e),o=ag(o),a=ag(a),e.isRawShaderMaterial!==!0&&(g=`#version 300 es
`,y=[d,"#define attribute in","#define varying out","#define texture2D texture"].join(`
`)+`
`+y,p=["#define varying in",e.glslVersion===Dd?"":"layout(location = 0) out highp vec4 pc_fragColor;",e.glslVersion===Dd?"":"#define gl_FragColor pc_fragColor","#define gl_FragDepthEXT gl_FragDepth","#define texture2D texture","#define textureCube texture","#define texture2DProj textureProj","#define texture2DLodEXT textureLod","#define texture2DProjLodEXT textureProjLod","#define textureCubeLodEXT textureLod","#define texture2DGradEXT textureGrad","#define texture2DProjGradEXT textureProjGrad","#define textureCubeGradEXT textureGrad"].join(`
`)+`
`+p);let v=g+y+o,E=g+p+a,b=ng(s,s.VERTEX_SHADER,v),I=ng(s,s.FRAGMENT_SHADER,E);s.attachShader(m,b),s.attachShader(m,I),e.index0AttributeName!==void 0?s.bindAttribLocation(m,0,e.index0AttributeName):e.hasPositionAttribute===!0&&s.bindAttribLocation(m,0,"position"),s.linkProgram(m);function A(N){if(i.debug.checkShaderErrors){let L=s.getProgramInfoLog(m)||"",X=s.getShaderInfoLog(b)||"",q=s.getShaderInfoLog(I)||"",D=L.trim(),W=X.trim(),J=q.trim(),H=!0,ht=!0;if(s.getProgramParameter(m,s.LINK_STATUS)===!1)if(H=!1,typeof i.debug.onShaderError=="function")i.debug.onShaderError(s,m,b,I);else{let j=sg(s,b,"vertex"),tt=sg(s,I,"fragment");ee("WebGLProgram: Shader Error "+s.getError()+" - VALIDATE_STATUS "+s.getProgramParameter(m,s.VALIDATE_STATUS)+`

Material Name: `+N.name+`
Material Type: `+N.type+`

Program Info Log: `+D+`
`+j+`
`+tt)}else D!==""?$t("WebGLProgram: Program Info Log:",D):(W===""||J==="")&&(ht=!1);ht&&(N.diagnostics={runnable:H,programLog:D,vertexShader:{log:W,prefix:y},fragmentShader:{log:J,prefix:p}})}s.deleteShader(b),s.deleteShader(I),x=new Vo(s,m),T=nM(s,m)}let x;this.getUniforms=function(){return x===void 0&&A(this),x};let T;this.getAttributes=function(){return T===void 0&&A(this),T};let V=e.rendererExtensionParallelShaderCompile===!1;return this.isReady=function(){return V===!1&&(V=s.getProgramParameter(m,qb)),V},this.destroy=function(){n.releaseStatesOfProgram(this),s.deleteProgram(m),this.program=void 0},this.type=e.shaderType,this.name=e.shaderName,this.id=Yb++,this.cacheKey=t,this.usedTimes=1,this.program=m,this.vertexShader=b,this.fragmentShader=I,this}var pM=0,$d=class{constructor(){this.shaderCache=new Map,this.materialCache=new Map}update(t,e,n){let s=this._getShaderCacheForMaterial(t);return s.has(e)===!1&&(s.add(e),e.usedTimes++),s.has(n)===!1&&(s.add(n),n.usedTimes++),this}remove(t){let e=this.materialCache.get(t);for(let n of e)n.usedTimes--,n.usedTimes===0&&this.shaderCache.delete(n.code);return this.materialCache.delete(t),this}getVertexShaderStage(t){return this._getShaderStage(t.vertexShader)}getFragmentShaderStage(t){return this._getShaderStage(t.fragmentShader)}dispose(){this.shaderCache.clear(),this.materialCache.clear()}_getShaderCacheForMaterial(t){let e=this.materialCache,n=e.get(t);return n===void 0&&(n=new Set,e.set(t,n)),n}_getShaderStage(t){let e=this.shaderCache,n=e.get(t);return n===void 0&&(n=new Kd(t),e.set(t,n)),n}},Kd=class{constructor(t){this.id=pM++,this.code=t,this.usedTimes=0}};function mM(i){return i===cr||i===Za||i===Ja}function gM(i,t,e,n,s,r){let o=new Eo,a=new $d,l=new Set,c=[],u=new Map,h=n.logarithmicDepthBuffer,d={MeshDepthMaterial:"depth",MeshDistanceMaterial:"distance",MeshNormalMaterial:"normal",MeshBasicMaterial:"basic",MeshLambertMaterial:"lambert",MeshPhongMaterial:"phong",MeshToonMaterial:"toon",MeshStandardMaterial:"physical",MeshPhysicalMaterial:"physical",MeshMatcapMaterial:"matcap",LineBasicMaterial:"basic",LineDashedMaterial:"dashed",PointsMaterial:"points",ShadowMaterial:"shadow",SpriteMaterial:"sprite"};function f(x){return l.add(x),x===0?"uv":`uv${x}`}function m(x,T,V,N,L,X){let q=N.fog,D=L.geometry,W=x.isMeshStandardMaterial||x.isMeshLambertMaterial||x.isMeshPhongMaterial?N.environment:null,J=x.isMeshStandardMaterial||x.isMeshLambertMaterial&&!x.envMap||x.isMeshPhongMaterial&&!x.envMap,H=t.get(x.envMap||W,J),ht=d[x.type],j=n.precision;x.precision!==null&&(j=n.getMaxPrecision(x.precision),j!==x.precision&&$t("WebGLProgram.getParameters:",x.precision,"not supported, using",j,"instead."));let tt=D.morphAttributes.position||D.morphAttributes.normal||D.morphAttributes.color,rt=tt!==void 0?tt.length:0,ft=0;D.morphAttributes.position!==void 0&&(ft=1),D.morphAttributes.normal!==void 0&&(ft=2),D.morphAttributes.color!==void 0&&(ft=3);let dt,et,gt,yt;if(ht){let Rt=ii[ht];dt=Rt.vertexShader,et=Rt.fragmentShader}else{dt=x.vertexShader,et=x.fragmentShader;let Rt=a.getVertexShaderStage(x),ce=a.getFragmentShaderStage(x);a.update(x,Rt,ce),gt=Rt.id,yt=ce.id}let Ct=i.getRenderTarget(),Mt=i.state.buffers.depth.getReversed(),Xt=L.isInstancedMesh===!0,oe=L.isBatchedMesh===!0,Ht=!!x.map,pe=!!x.matcap,ue=!!H,se=ue&&H.isPMREMTexture===!0,$e=!!x.aoMap,Ve=!!x.lightMap,an=!!x.bumpMap&&x.wireframe===!1,Ue=!!x.normalMap,En=!!x.displacementMap,Se=!!x.emissiveMap,xn=!!x.metalnessMap,je=!!x.roughnessMap,ln=x.anisotropy>0,O=x.clearcoat>0,It=x.diffuseRoughness>0,Kt=x.dispersion>0,ae=x.retroreflectivity>0,wt=x.iridescence>0,Be=x.sheen>0,Gt=x.transmission>0,Yt=ln&&!!x.anisotropyMap,C=O&&!!x.clearcoatMap,S=O&&!!x.clearcoatNormalMap,Y=O&&!!x.clearcoatRoughnessMap,ut=It&&!!x.diffuseRoughnessMap,at=wt&&!!x.iridescenceMap,xt=wt&&!!x.iridescenceThicknessMap,vt=Be&&!!x.sheenColorMap,nt=Be&&!!x.sheenRoughnessMap,st=!!x.specularMap,mt=!!x.specularColorMap,U=!!x.specularIntensityMap,ot=Gt&&!!x.transmissionMap,it=Gt&&!!x.thicknessMap,Tt=!!x.gradientMap,_t=!!x.alphaMap,bt=x.alphaTest>0,Wt=!!x.alphaHash,Qt=!!x.extensions,ct=us;x.toneMapped&&(Ct===null||Ct.isXRRenderTarget===!0)&&(ct=i.toneMapping);let kt=se?H.isCompressedCubeTexture?H.image[0].mipmaps:H.mipmaps:null,te={shaderID:ht,shaderType:x.type,shaderName:x.name,vertexShader:dt,fragmentShader:et,defines:x.defines,customVertexShaderID:gt,customFragmentShaderID:yt,isRawShaderMaterial:x.isRawShaderMaterial===!0,glslVersion:x.glslVersion,precision:j,batching:oe,batchingColor:oe&&L._colorsTexture!==null,instancing:Xt,instancingColor:Xt&&L.instanceColor!==null,instancingMorph:Xt&&L.morphTexture!==null,outputColorSpace:Ct===null?i.outputColorSpace:Ct.isXRRenderTarget===!0?Ct.texture.colorSpace:ye.workingColorSpace,alphaToCoverage:!!x.alphaToCoverage,map:Ht,matcap:pe,envMap:ue,envMapMode:ue&&H.mapping,envMapPMREM:se,envMapMaxLod:se?kt.length-1:null,envMapSize:se?kt[0].width:null,aoMap:$e,lightMap:Ve,bumpMap:an,normalMap:Ue,displacementMap:En,emissiveMap:Se,normalMapObjectSpace:Ue&&x.normalMapType===Lm,normalMapTangentSpace:Ue&&x.normalMapType===Eh,packedNormalMap:Ue&&x.normalMapType===Eh&&mM(x.normalMap.format),metalnessMap:xn,roughnessMap:je,anisotropy:ln,anisotropyMap:Yt,clearcoat:O,clearcoatMap:C,clearcoatNormalMap:S,clearcoatRoughnessMap:Y,diffuseRoughness:It,diffuseRoughnessMap:ut,dispersion:Kt,retroreflection:ae,iridescence:wt,iridescenceMap:at,iridescenceThicknessMap:xt,sheen:Be,sheenColorMap:vt,sheenRoughnessMap:nt,specularMap:st,specularColorMap:mt,specularIntensityMap:U,transmission:Gt,transmissionMap:ot,thicknessMap:it,gradientMap:Tt,opaque:x.transparent===!1&&x.blending===Bo&&x.alphaToCoverage===!1,alphaMap:_t,alphaTest:bt,alphaHash:Wt,combine:x.combine,mapUv:Ht&&f(x.map.channel),aoMapUv:$e&&f(x.aoMap.channel),lightMapUv:Ve&&f(x.lightMap.channel),bumpMapUv:an&&f(x.bumpMap.channel),normalMapUv:Ue&&f(x.normalMap.channel),displacementMapUv:En&&f(x.displacementMap.channel),emissiveMapUv:Se&&f(x.emissiveMap.channel),metalnessMapUv:xn&&f(x.metalnessMap.channel),roughnessMapUv:je&&f(x.roughnessMap.channel),anisotropyMapUv:Yt&&f(x.anisotropyMap.channel),clearcoatMapUv:C&&f(x.clearcoatMap.channel),clearcoatNormalMapUv:S&&f(x.clearcoatNormalMap.channel),clearcoatRoughnessMapUv:Y&&f(x.clearcoatRoughnessMap.channel),diffuseRoughnessMapUv:ut&&f(x.diffuseRoughnessMap.channel),iridescenceMapUv:at&&f(x.iridescenceMap.channel),iridescenceThicknessMapUv:xt&&f(x.iridescenceThicknessMap.channel),sheenColorMapUv:vt&&f(x.sheenColorMap.channel),sheenRoughnessMapUv:nt&&f(x.sheenRoughnessMap.channel),specularMapUv:st&&f(x.specularMap.channel),specularColorMapUv:mt&&f(x.specularColorMap.channel),specularIntensityMapUv:U&&f(x.specularIntensityMap.channel),transmissionMapUv:ot&&f(x.transmissionMap.channel),thicknessMapUv:it&&f(x.thicknessMap.channel),alphaMapUv:_t&&f(x.alphaMap.channel),vertexTangents:!!D.attributes.tangent&&(Ue||ln),vertexNormals:!!D.attributes.normal,vertexColors:x.vertexColors,vertexAlphas:x.vertexColors===!0&&!!D.attributes.color&&D.attributes.color.itemSize===4,pointsUvs:L.isPoints===!0&&!!D.attributes.uv&&(Ht||_t),fog:!!q,useFog:x.fog===!0,fogExp2:!!q&&q.isFogExp2,flatShading:x.wireframe===!1&&(x.flatShading===!0||D.attributes.normal===void 0&&Ue===!1&&(x.isMeshLambertMaterial||x.isMeshPhongMaterial||x.isMeshStandardMaterial||x.isMeshPhysicalMaterial)),sizeAttenuation:x.sizeAttenuation===!0,logarithmicDepthBuffer:h,reversedDepthBuffer:Mt,skinning:L.isSkinnedMesh===!0,hasPositionAttribute:D.attributes.position!==void 0,morphTargets:D.morphAttributes.position!==void 0,morphNormals:D.morphAttributes.normal!==void 0,morphColors:D.morphAttributes.color!==void 0,morphTargetsCount:rt,morphTextureStride:ft,numSunLights:T.sun.length,numDirLights:T.directional.length,numPointLights:T.point.length,numSpotLights:T.spot.length,numSpotLightMaps:T.spotLightMap.length,numRectAreaLights:T.rectArea.length,numHemiLights:T.hemi.length,numSunLightShadows:T.sunShadowMap.length,numDirLightShadows:T.directionalShadowMap.length,numPointLightShadows:T.pointShadowMap.length,numSpotLightShadows:T.spotShadowMap.length,numSpotLightShadowsWithMaps:T.numSpotLightShadowsWithMaps,numLightProbes:T.numLightProbes,numLightProbeGrids:X.filter(Rt=>Rt.texture!==null).length,numClippingPlanes:r.numPlanes,numClipIntersection:r.numIntersection,dithering:x.dithering,shadowMapEnabled:i.shadowMap.enabled&&V.length>0,shadowMapType:i.shadowMap.type,toneMapping:ct,decodeVideoTexture:Ht&&x.map.isVideoTexture===!0&&ye.getTransfer(x.map.colorSpace)===Re,decodeVideoTextureEmissive:Se&&x.emissiveMap.isVideoTexture===!0&&ye.getTransfer(x.emissiveMap.colorSpace)===Re,premultipliedAlpha:x.premultipliedAlpha,doubleSided:x.side===ri,flipSided:x.side===ni,useDepthPacking:x.depthPacking>=0,depthPacking:x.depthPacking||0,index0AttributeName:x.index0AttributeName,extensionClipCullDistance:Qt&&x.extensions.clipCullDistance===!0&&e.has("WEBGL_clip_cull_distance"),extensionMultiDraw:(Qt&&x.extensions.multiDraw===!0||oe)&&e.has("WEBGL_multi_draw"),rendererExtensionParallelShaderCompile:e.has("KHR_parallel_shader_compile"),customProgramCacheKey:x.customProgramCacheKey()};return te.vertexUv1s=l.has(1),te.vertexUv2s=l.has(2),te.vertexUv3s=l.has(3),l.clear(),te}function y(x){let T=[];if(x.shaderID?T.push(x.shaderID):(T.push(x.customVertexShaderID),T.push(x.customFragmentShaderID)),x.defines!==void 0)for(let V in x.defines)T.push(V),T.push(x.defines[V]);return x.isRawShaderMaterial===!1&&(p(T,x),g(T,x),T.push(i.outputColorSpace)),T.push(x.customProgramCacheKey),T.join()}function p(x,T){x.push(T.precision),x.push(T.outputColorSpace),x.push(T.envMapMode),x.push(T.envMapPMREM),x.push(T.envMapMaxLod),x.push(T.envMapSize),x.push(T.mapUv),x.push(T.alphaMapUv),x.push(T.lightMapUv),x.push(T.aoMapUv),x.push(T.bumpMapUv),x.push(T.normalMapUv),x.push(T.displacementMapUv),x.push(T.emissiveMapUv),x.push(T.metalnessMapUv),x.push(T.roughnessMapUv),x.push(T.anisotropyMapUv),x.push(T.clearcoatMapUv),x.push(T.clearcoatNormalMapUv),x.push(T.clearcoatRoughnessMapUv),x.push(T.diffuseRoughnessMapUv),x.push(T.iridescenceMapUv),x.push(T.iridescenceThicknessMapUv),x.push(T.sheenColorMapUv),x.push(T.sheenRoughnessMapUv),x.push(T.specularMapUv),x.push(T.specularColorMapUv),x.push(T.specularIntensityMapUv),x.push(T.transmissionMapUv),x.push(T.thicknessMapUv),x.push(T.combine),x.push(T.fogExp2),x.push(T.sizeAttenuation),x.push(T.morphTargetsCount),x.push(T.numSunLights),x.push(T.numDirLights),x.push(T.numPointLights),x.push(T.numSpotLights),x.push(T.numSpotLightMaps),x.push(T.numHemiLights),x.push(T.numRectAreaLights),x.push(T.numSunLightShadows),x.push(T.numDirLightShadows),x.push(T.numPointLightShadows),x.push(T.numSpotLightShadows),x.push(T.numSpotLightShadowsWithMaps),x.push(T.numLightProbes),x.push(T.numLightProbeGrids),x.push(T.shadowMapType),x.push(T.toneMapping),x.push(T.numClippingPlanes),x.push(T.numClipIntersection),x.push(T.depthPacking)}function g(x,T){o.disableAll(),T.instancing&&o.enable(0),T.instancingColor&&o.enable(1),T.instancingMorph&&o.enable(2),T.matcap&&o.enable(3),T.envMap&&o.enable(4),T.normalMapObjectSpace&&o.enable(5),T.normalMapTangentSpace&&o.enable(6),T.clearcoat&&o.enable(7),T.iridescence&&o.enable(8),T.alphaTest&&o.enable(9),T.vertexColors&&o.enable(10),T.vertexAlphas&&o.enable(11),T.vertexUv1s&&o.enable(12),T.vertexUv2s&&o.enable(13),T.vertexUv3s&&o.enable(14),T.vertexTangents&&o.enable(15),T.anisotropy&&o.enable(16),T.alphaHash&&o.enable(17),T.batching&&o.enable(18),T.dispersion&&o.enable(19),T.retroreflection&&o.enable(24),T.diffuseRoughness&&o.enable(25),T.batchingColor&&o.enable(20),T.gradientMap&&o.enable(21),T.packedNormalMap&&o.enable(22),T.vertexNormals&&o.enable(23),x.push(o.mask),o.disableAll(),T.fog&&o.enable(0),T.useFog&&o.enable(1),T.flatShading&&o.enable(2),T.logarithmicDepthBuffer&&o.enable(3),T.reversedDepthBuffer&&o.enable(4),T.skinning&&o.enable(5),T.morphTargets&&o.enable(6),T.morphNormals&&o.enable(7),T.morphColors&&o.enable(8),T.premultipliedAlpha&&o.enable(9),T.shadowMapEnabled&&o.enable(10),T.doubleSided&&o.enable(11),T.flipSided&&o.enable(12),T.useDepthPacking&&o.enable(13),T.dithering&&o.enable(14),T.transmission&&o.enable(15),T.sheen&&o.enable(16),T.opaque&&o.enable(17),T.pointsUvs&&o.enable(18),T.decodeVideoTexture&&o.enable(19),T.decodeVideoTextureEmissive&&o.enable(20),T.alphaToCoverage&&o.enable(21),T.numLightProbeGrids>0&&o.enable(22),T.hasPositionAttribute&&o.enable(23),x.push(o.mask)}function v(x){let T=d[x.type],V;if(T){let N=ii[T];V=Qa.clone(N.uniforms)}else V=x.uniforms;return V}function E(x,T){let V=u.get(T);return V!==void 0?++V.usedTimes:(V=new fM(i,T,x,s),c.push(V),u.set(T,V)),V}function b(x){if(--x.usedTimes===0){let T=c.indexOf(x);c[T]=c[c.length-1],c.pop(),u.delete(x.cacheKey),x.destroy()}}function I(x){a.remove(x)}function A(){a.dispose()}return{getParameters:m,getProgramCacheKey:y,getUniforms:v,acquireProgram:E,releaseProgram:b,releaseShaderCache:I,programs:c,dispose:A}}function _M(){let i=new WeakMap;function t(o){return i.has(o)}function e(o){let a=i.get(o);return a===void 0&&(a={},i.set(o,a)),a}function n(o){i.delete(o)}function s(o,a,l){i.get(o)[a]=l}function r(){i=new WeakMap}return{has:t,get:e,remove:n,update:s,dispose:r}}function xM(i,t){return i.groupOrder!==t.groupOrder?i.groupOrder-t.groupOrder:i.renderOrder!==t.renderOrder?i.renderOrder-t.renderOrder:i.material.id!==t.material.id?i.material.id-t.material.id:i.materialVariant!==t.materialVariant?i.materialVariant-t.materialVariant:i.z!==t.z?i.z-t.z:i.id-t.id}function cg(i,t){return i.groupOrder!==t.groupOrder?i.groupOrder-t.groupOrder:i.renderOrder!==t.renderOrder?i.renderOrder-t.renderOrder:i.z!==t.z?t.z-i.z:i.id-t.id}function hg(){let i=[],t=0,e=[],n=[],s=[];function r(){t=0,e.length=0,n.length=0,s.length=0}function o(d){let f=0;return d.isInstancedMesh&&(f+=2),d.isSkinnedMesh&&(f+=1),f}function a(d,f,m,y,p,g){let v=i[t];return v===void 0?(v={id:d.id,object:d,geometry:f,material:m,materialVariant:o(d),groupOrder:y,renderOrder:d.renderOrder,z:p,group:g},i[t]=v):(v.id=d.id,v.object=d,v.geometry=f,v.material=m,v.materialVariant=o(d),v.groupOrder=y,v.renderOrder=d.renderOrder,v.z=p,v.group=g),t++,v}function l(d,f,m,y,p,g,v){v.reversedDepth===!0&&(p=-p);let E=a(d,f,m,y,p,g);m.transmission>0?n.push(E):m.transparent===!0?s.push(E):e.push(E)}function c(d,f,m,y,p,g){let v=a(d,f,m,y,p,g);m.transmission>0?n.unshift(v):m.transparent===!0?s.unshift(v):e.unshift(v)}function u(d,f){e.length>1&&e.sort(d||xM),n.length>1&&n.sort(f||cg),s.length>1&&s.sort(f||cg)}function h(){for(let d=t,f=i.length;d<f;d++){let m=i[d];if(m.id===null)break;m.id=null,m.object=null,m.geometry=null,m.material=null,m.group=null}}return{opaque:e,transmissive:n,transparent:s,init:r,push:l,unshift:c,finish:h,sort:u}}function yM(){let i=new WeakMap;function t(n,s){let r=i.get(n),o;return r===void 0?(o=new hg,i.set(n,[o])):s>=r.length?(o=new hg,r.push(o)):o=r[s],o}function e(){i=new WeakMap}return{get:t,dispose:e}}function vM(){let i={};return{get:function(t){if(i[t.id]!==void 0)return i[t.id];let e;switch(t.type){case"SunLight":case"DirectionalLight":e={direction:new k,color:new he};break;case"SpotLight":e={position:new k,direction:new k,color:new he,distance:0,coneCos:0,penumbraCos:0,decay:0};break;case"PointLight":e={position:new k,color:new he,distance:0,decay:0};break;case"HemisphereLight":e={direction:new k,skyColor:new he,groundColor:new he};break;case"RectAreaLight":e={color:new he,position:new k,halfWidth:new k,halfHeight:new k};break}return i[t.id]=e,e}}}function SM(){let i={};return{get:function(t){if(i[t.id]!==void 0)return i[t.id];let e;switch(t.type){case"SunLight":case"DirectionalLight":e={shadowIntensity:1,shadowBias:0,shadowNormalBias:0,shadowRadius:1,shadowMapSize:new Zt};break;case"SpotLight":e={shadowIntensity:1,shadowBias:0,shadowNormalBias:0,shadowRadius:1,shadowMapSize:new Zt};break;case"PointLight":e={shadowIntensity:1,shadowBias:0,shadowNormalBias:0,shadowRadius:1,shadowMapSize:new Zt,shadowCameraNear:1,shadowCameraFar:1e3};break}return i[t.id]=e,e}}}var bM=0;function MM(i,t){return(t.castShadow?2:0)-(i.castShadow?2:0)+(t.map?1:0)-(i.map?1:0)}function wM(i){let t=new vM,e=SM(),n={version:0,hash:{sunLength:-1,directionalLength:-1,pointLength:-1,spotLength:-1,rectAreaLength:-1,hemiLength:-1,numSunShadows:-1,numDirectionalShadows:-1,numPointShadows:-1,numSpotShadows:-1,numSpotMaps:-1,numLightProbes:-1},ambient:[0,0,0],probe:[],sun:[],sunShadow:[],sunShadowMap:[],sunShadowMatrix:[],sunShadowCascade:[],directional:[],directionalShadow:[],directionalShadowMap:[],directionalShadowMatrix:[],spot:[],spotLightMap:[],spotShadow:[],spotShadowMap:[],spotLightMatrix:[],rectArea:[],rectAreaLTC1:null,rectAreaLTC2:null,point:[],pointShadow:[],pointShadowMap:[],pointShadowMatrix:[],hemi:[],numSpotLightShadowsWithMaps:0,numLightProbes:0};for(let c=0;c<9;c++)n.probe.push(new k);let s=new k,r=new be,o=new be;function a(c){let u=0,h=0,d=0;for(let X=0;X<9;X++)n.probe[X].set(0,0,0);let f=0,m=0,y=0,p=0,g=0,v=0,E=0,b=0,I=0,A=0,x=0,T=0,V=0,N=0;c.sort(MM);for(let X=0,q=c.length;X<q;X++){let D=c[X],W=D.color,J=D.intensity,H=D.distance,ht=null;if(D.shadow&&D.shadow.map&&(D.shadow.map.texture.format===cr?ht=D.shadow.map.texture:ht=D.shadow.map.depthTexture||D.shadow.map.texture),D.isAmbientLight)u+=W.r*J,h+=W.g*J,d+=W.b*J;else if(D.isLightProbe){for(let j=0;j<9;j++)n.probe[j].addScaledVector(D.sh.coefficients[j],J);N++}else if(D.isSunLight){let j=t.get(D);if(j.color.copy(D.color).multiplyScalar(D.intensity),D.castShadow){let tt=D.shadow,rt=e.get(D);rt.shadowIntensity=tt.intensity,rt.shadowBias=tt.bias,rt.shadowNormalBias=tt.normalBias,rt.shadowRadius=tt.radius,rt.shadowMapSize.copy(tt.mapSize).multiply(tt.getFrameExtents()),n.sunShadow[m]=rt,n.sunShadowMap[m]=ht;let ft=tt.getViewportCount();for(let dt=0;dt<ft;dt++)n.sunShadowMatrix[y+dt]=tt.getMatrix(dt),n.sunShadowCascade[y+dt]=tt._cascadeData[dt];y+=ft,m++}n.sun[f]=j,f++}else if(D.isDirectionalLight){let j=t.get(D);if(j.color.copy(D.color).multiplyScalar(D.intensity),D.castShadow){let tt=D.shadow,rt=e.get(D);rt.shadowIntensity=tt.intensity,rt.shadowBias=tt.bias,rt.shadowNormalBias=tt.normalBias,rt.shadowRadius=tt.radius,rt.shadowMapSize=tt.mapSize,n.directionalShadow[p]=rt,n.directionalShadowMap[p]=ht,n.directionalShadowMatrix[p]=D.shadow.matrix,I++}n.directional[p]=j,p++}else if(D.isSpotLight){let j=t.get(D);j.position.setFromMatrixPosition(D.matrixWorld),j.color.copy(W).multiplyScalar(J),j.distance=H,j.coneCos=Math.cos(D.angle),j.penumbraCos=Math.cos(D.angle*(1-D.penumbra)),j.decay=D.decay,n.spot[v]=j;let tt=D.shadow;if(D.map&&(n.spotLightMap[T]=D.map,T++,tt.updateMatrices(D),D.castShadow&&V++),n.spotLightMatrix[v]=tt.matrix,D.castShadow){let rt=e.get(D);rt.shadowIntensity=tt.intensity,rt.shadowBias=tt.bias,rt.shadowNormalBias=tt.normalBias,rt.shadowRadius=tt.radius,rt.shadowMapSize=tt.mapSize,n.spotShadow[v]=rt,n.spotShadowMap[v]=ht,x++}v++}else if(D.isRectAreaLight){let j=t.get(D);j.color.copy(W).multiplyScalar(J),j.halfWidth.set(D.width*.5,0,0),j.halfHeight.set(0,D.height*.5,0),n.rectArea[E]=j,E++}else if(D.isPointLight){let j=t.get(D);if(j.color.copy(D.color).multiplyScalar(D.intensity),j.distance=D.distance,j.decay=D.decay,D.castShadow){let tt=D.shadow,rt=e.get(D);rt.shadowIntensity=tt.intensity,rt.shadowBias=tt.bias,rt.shadowNormalBias=tt.normalBias,rt.shadowRadius=tt.radius,rt.shadowMapSize=tt.mapSize,rt.shadowCameraNear=tt.camera.near,rt.shadowCameraFar=tt.camera.far,n.pointShadow[g]=rt,n.pointShadowMap[g]=ht,n.pointShadowMatrix[g]=D.shadow.matrix,A++}n.point[g]=j,g++}else if(D.isHemisphereLight){let j=t.get(D);j.skyColor.copy(D.color).multiplyScalar(J),j.groundColor.copy(D.groundColor).multiplyScalar(J),n.hemi[b]=j,b++}}E>0&&(i.has("OES_texture_float_linear")===!0?(n.rectAreaLTC1=Pt.LTC_FLOAT_1,n.rectAreaLTC2=Pt.LTC_FLOAT_2):(n.rectAreaLTC1=Pt.LTC_HALF_1,n.rectAreaLTC2=Pt.LTC_HALF_2)),n.ambient[0]=u,n.ambient[1]=h,n.ambient[2]=d;let L=n.hash;(L.sunLength!==f||L.directionalLength!==p||L.pointLength!==g||L.spotLength!==v||L.rectAreaLength!==E||L.hemiLength!==b||L.numSunShadows!==m||L.numDirectionalShadows!==I||L.numPointShadows!==A||L.numSpotShadows!==x||L.numSpotMaps!==T||L.numLightProbes!==N)&&(n.sun.length=f,n.directional.length=p,n.spot.length=v,n.rectArea.length=E,n.point.length=g,n.hemi.length=b,n.sunShadow.length=m,n.sunShadowMap.length=m,n.sunShadowMatrix.length=y,n.sunShadowCascade.length=y,n.directionalShadow.length=I,n.directionalShadowMap.length=I,n.directionalShadowMatrix.length=I,n.pointShadow.length=A,n.pointShadowMap.length=A,n.pointShadowMatrix.length=A,n.spotShadow.length=x,n.spotShadowMap.length=x,n.spotLightMatrix.length=x+T-V,n.spotLightMap.length=T,n.numSpotLightShadowsWithMaps=V,n.numLightProbes=N,L.sunLength=f,L.directionalLength=p,L.pointLength=g,L.spotLength=v,L.rectAreaLength=E,L.hemiLength=b,L.numSunShadows=m,L.numDirectionalShadows=I,L.numPointShadows=A,L.numSpotShadows=x,L.numSpotMaps=T,L.numLightProbes=N,n.version=bM++)}function l(c,u){let h=0,d=0,f=0,m=0,y=0,p=0,g=u.matrixWorldInverse;for(let v=0,E=c.length;v<E;v++){let b=c[v];if(b.isSunLight){let I=n.sun[h];I.direction.setFromMatrixPosition(b.matrixWorld),I.direction.transformDirection(g),h++}else if(b.isDirectionalLight){let I=n.directional[d];I.direction.setFromMatrixPosition(b.matrixWorld),s.setFromMatrixPosition(b.target.matrixWorld),I.direction.sub(s),I.direction.transformDirection(g),d++}else if(b.isSpotLight){let I=n.spot[m];I.position.setFromMatrixPosition(b.matrixWorld),I.position.applyMatrix4(g),I.direction.setFromMatrixPosition(b.matrixWorld),s.setFromMatrixPosition(b.target.matrixWorld),I.direction.sub(s),I.direction.transformDirection(g),m++}else if(b.isRectAreaLight){let I=n.rectArea[y];I.position.setFromMatrixPosition(b.matrixWorld),I.position.applyMatrix4(g),o.identity(),r.copy(b.matrixWorld),r.premultiply(g),o.extractRotation(r),I.halfWidth.set(b.width*.5,0,0),I.halfHeight.set(0,b.height*.5,0),I.halfWidth.applyMatrix4(o),I.halfHeight.applyMatrix4(o),y++}else if(b.isPointLight){let I=n.point[f];I.position.setFromMatrixPosition(b.matrixWorld),I.position.applyMatrix4(g),f++}else if(b.isHemisphereLight){let I=n.hemi[p];I.direction.setFromMatrixPosition(b.matrixWorld),I.direction.transformDirection(g),p++}}}return{setup:a,setupView:l,state:n}}function ug(i){let t=new wM(i),e=[],n=[],s=[];function r(h){u.camera=h,e.length=0,n.length=0,s.length=0}function o(h){h.isLightProbeGrid?s.push(h):e.push(h)}function a(h){n.push(h)}function l(){t.setup(e),s.sort((h,d)=>h.priority-d.priority||h.id-d.id)}function c(h){t.setupView(e,h)}let u={lightsArray:e,shadowsArray:n,lightProbeGridArray:s,camera:null,lights:t,transmissionRenderTarget:{},textureUnits:0};return{init:r,state:u,setupLights:l,setupLightsView:c,pushLight:o,pushShadow:a}}function TM(i){let t=new WeakMap;function e(s,r=0){let o=t.get(s),a;return o===void 0?(a=new ug(i),t.set(s,[a])):r>=o.length?(a=new ug(i),o.push(a)):a=o[r],a}function n(){t=new WeakMap}return{get:e,dispose:n}}var AM=`void main() {
	gl_Position = vec4( position, 1.0 );
}`,EM=`uniform sampler2D shadow_pass;
uniform vec2 resolution;
uniform float radius;
void main() {
	const float samples = float( VSM_SAMPLES );
	float mean = 0.0;
	float squared_mean = 0.0;
	float uvStride = samples <= 1.0 ? 0.0 : 2.0 / ( samples - 1.0 );
	float uvStart = samples <= 1.0 ? 0.0 : - 1.0;
	for ( float i = 0.0; i < samples; i ++ ) {
		float uvOffset = uvStart + i * uvStride;
		#ifdef HORIZONTAL_PASS
			vec2 distribution = texture2D( shadow_pass, ( gl_FragCoord.xy + vec2( uvOffset, 0.0 ) * radius ) / resolution ).rg;
			mean += distribution.x;
			squared_mean += distribution.y * distribution.y + distribution.x * distribution.x;
		#else
			float depth = texture2D( shadow_pass, ( gl_FragCoord.xy + vec2( 0.0, uvOffset ) * radius ) / resolution ).r;
			mean += depth;
			squared_mean += depth * depth;
		#endif
	}
	mean = mean / samples;
	squared_mean = squared_mean / samples;
	float std_dev = sqrt( max( 0.0, squared_mean - mean * mean ) );
	gl_FragColor = vec4( mean, std_dev, 0.0, 1.0 );
}`,CM=[new k(1,0,0),new k(-1,0,0),new k(0,1,0),new k(0,-1,0),new k(0,0,1),new k(0,0,-1)],RM=[new k(0,-1,0),new k(0,-1,0),new k(0,0,1),new k(0,0,-1),new k(0,-1,0),new k(0,-1,0)],dg=new be,tl=new k,Hd=new k;function IM(i,t,e){let n=new tr,s=new Zt,r=new Zt,o=new Ie,a=new Ec,l=new Cc,c={},u=e.maxTextureSize,h={[lr]:ni,[ni]:lr,[ri]:ri},d=new Ri({defines:{VSM_SAMPLES:8},uniforms:{shadow_pass:{value:null},resolution:{value:new Zt},radius:{value:4}},vertexShader:AM,fragmentShader:EM}),f=d.clone();f.defines.HORIZONTAL_PASS=1;let m=new gn;m.setAttribute("position",new vn(new Float32Array([-1,-1,.5,3,-1,.5,-1,3,.5]),3));let y=new Sn(m,d),p=this;this.enabled=!1,this.autoUpdate=!0,this.needsUpdate=!1,this.type=Wa;let g=this.type;this.render=function(A,x,T){if(p.enabled===!1||p.autoUpdate===!1&&p.needsUpdate===!1||A.length===0)return;this.type===cm&&($t("WebGLShadowMap: PCFSoftShadowMap has been removed. Using PCFShadowMap instead."),this.type=Wa);let V=i.getRenderTarget(),N=i.getActiveCubeFace(),L=i.getActiveMipmapLevel(),X=i.state;X.setBlending(Ar),X.buffers.depth.getReversed()===!0?X.buffers.color.setClear(0,0,0,0):X.buffers.color.setClear(1,1,1,1),X.buffers.depth.setTest(!0),X.setScissorTest(!1);let q=g!==this.type;q&&x.traverse(function(D){D.material&&(Array.isArray(D.material)?D.material.forEach(W=>W.needsUpdate=!0):D.material.needsUpdate=!0)});for(let D=0,W=A.length;D<W;D++){let J=A[D],H=J.shadow;if(H===void 0){$t("WebGLShadowMap:",J,"has no shadow.");continue}if(H.autoUpdate===!1&&H.needsUpdate===!1)continue;s.copy(H.mapSize);let ht=H.getFrameExtents();s.multiply(ht),r.copy(H.mapSize),(s.x>u||s.y>u)&&(s.x>u&&(r.x=Math.floor(u/ht.x),s.x=r.x*ht.x,H.mapSize.x=r.x),s.y>u&&(r.y=Math.floor(u/ht.y),s.y=r.y*ht.y,H.mapSize.y=r.y));let j=i.state.buffers.depth.getReversed();if(H.camera._reversedDepth=j,H.map===null||q===!0){if(H.map!==null&&(H.map.depthTexture!==null&&(H.map.depthTexture.dispose(),H.map.depthTexture=null),H.map.dispose()),this.type===Fo){if(J.isPointLight){$t("WebGLShadowMap: VSM shadow maps are not supported for PointLights. Use PCF or BasicShadowMap instead.");continue}H.map=new xi(s.x,s.y,{format:cr,type:Wi,minFilter:ti,magFilter:ti,generateMipmaps:!1}),H.map.texture.name=J.name+".shadowMap",H.map.depthTexture=new Ds(s.x,s.y,Hi),H.map.depthTexture.name=J.name+".shadowMapDepth",H.map.depthTexture.format=Is,H.map.depthTexture.compareFunction=null,H.map.depthTexture.minFilter=mn,H.map.depthTexture.magFilter=mn}else J.isPointLight?(H.map=new nl(s.x),H.map.depthTexture=new Pa(s.x,Gi)):(H.map=new xi(s.x,s.y),H.map.depthTexture=new Ds(s.x,s.y,Gi)),H.map.depthTexture.name=J.name+".shadowMap",H.map.depthTexture.format=Is,this.type===Wa?(H.map.depthTexture.compareFunction=j?Id:Rd,H.map.depthTexture.minFilter=ti,H.map.depthTexture.magFilter=ti):(H.map.depthTexture.compareFunction=null,H.map.depthTexture.minFilter=mn,H.map.depthTexture.magFilter=mn);H.camera.updateProjectionMatrix()}H.map.isWebGLCubeRenderTarget!==!0&&(H.map.width!==s.x||H.map.height!==s.y)&&H.map.setSize(s.x,s.y);let tt=H.map.isWebGLCubeRenderTarget?6:H.getViewportCount();J.isPointLight!==!0&&H.updateMatrices(J,T);let rt=(H.camera.layers.mask&4294967294)!==0?H.camera.layers:T.layers;for(let ft=0;ft<tt;ft++){let dt=H.getCamera(ft);if(J.isPointLight){let et=H.camera,gt=H.matrix,yt=J.distance||et.far;yt!==et.far&&(et.far=yt,et.updateProjectionMatrix()),tl.setFromMatrixPosition(J.matrixWorld),et.position.copy(tl),Hd.copy(et.position),Hd.add(CM[ft]),et.up.copy(RM[ft]),et.lookAt(Hd),et.updateMatrixWorld(),gt.makeTranslation(-tl.x,-tl.y,-tl.z),dg.multiplyMatrices(et.projectionMatrix,et.matrixWorldInverse),H._frustum.setFromProjectionMatrix(dg,et.coordinateSystem,et.reversedDepth)}if(H.map.isWebGLCubeRenderTarget)i.setRenderTarget(H.map,ft),i.clear();else{ft===0&&(i.setRenderTarget(H.map),i.clear());let et=H.getViewport(ft);o.set(r.x*et.x,r.y*et.y,r.x*et.z,r.y*et.w),X.viewport(o)}n=H.getFrustum(ft),b(x,T,dt,J,rt,this.type)}H.isPointLightShadow!==!0&&this.type===Fo&&v(H,T),H.needsUpdate=!1}g=this.type,p.needsUpdate=!1,i.setRenderTarget(V,N,L)};function v(A,x){let T=t.update(y);d.defines.VSM_SAMPLES!==A.blurSamples&&(d.defines.VSM_SAMPLES=A.blurSamples,f.defines.VSM_SAMPLES=A.blurSamples,d.needsUpdate=!0,f.needsUpdate=!0),A.mapPass===null?A.mapPass=new xi(s.x,s.y,{format:cr,type:Wi}):(A.mapPass.width!==A.map.width||A.mapPass.height!==A.map.height)&&A.mapPass.setSize(A.map.width,A.map.height),d.uniforms.shadow_pass.value=A.map.depthTexture,d.uniforms.resolution.value.set(A.map.width,A.map.height),d.uniforms.radius.value=A.radius,i.setRenderTarget(A.mapPass),i.clear(),i.renderBufferDirect(x,null,T,d,y,null),f.uniforms.shadow_pass.value=A.mapPass.texture,f.uniforms.resolution.value.set(A.map.width,A.map.height),f.uniforms.radius.value=A.radius,i.setRenderTarget(A.map),i.clear(),i.renderBufferDirect(x,null,T,f,y,null)}function E(A,x,T,V){let N=null,L=T.isPointLight===!0?A.customDistanceMaterial:A.customDepthMaterial;if(L!==void 0)N=L;else if(N=T.isPointLight===!0?l:a,i.localClippingEnabled&&x.clipShadows===!0&&Array.isArray(x.clippingPlanes)&&x.clippingPlanes.length!==0||x.displacementMap&&x.displacementScale!==0||x.alphaMap&&x.alphaTest>0||x.map&&x.alphaTest>0||x.alphaToCoverage===!0){let X=N.uuid,q=x.uuid,D=c[X];D===void 0&&(D={},c[X]=D);let W=D[q];W===void 0&&(W=N.clone(),D[q]=W,x.addEventListener("dispose",I)),N=W}if(N.visible=x.visible,N.wireframe=x.wireframe,V===Fo?N.side=x.shadowSide!==null?x.shadowSide:x.side:N.side=x.shadowSide!==null?x.shadowSide:h[x.side],N.alphaMap=x.alphaMap,N.alphaTest=x.alphaToCoverage===!0?.5:x.alphaTest,N.map=x.map,N.clipShadows=x.clipShadows,N.clippingPlanes=x.clippingPlanes,N.clipIntersection=x.clipIntersection,N.displacementMap=x.displacementMap,N.displacementScale=x.displacementScale,N.displacementBias=x.displacementBias,N.wireframeLinewidth=x.wireframeLinewidth,N.linewidth=x.linewidth,T.isPointLight===!0&&N.isMeshDistanceMaterial===!0){let X=i.properties.get(N);X.light=T}return N}function b(A,x,T,V,N,L){if(A.visible===!1)return;if(A.layers.test(N)&&(A.isMesh||A.isLine||A.isPoints)&&(A.castShadow||A.receiveShadow&&L===Fo)&&(!A.frustumCulled||A.intersectsFrustum(n))){A.modelViewMatrix.multiplyMatrices(T.matrixWorldInverse,A.matrixWorld);let D=t.update(A),W=A.material;if(Array.isArray(W)){let J=D.groups;for(let H=0,ht=J.length;H<ht;H++){let j=J[H],tt=W[j.materialIndex];if(tt&&tt.visible){let rt=E(A,tt,V,L);A.onBeforeShadow(i,A,x,T,D,rt,j),i.renderBufferDirect(T,null,D,rt,A,j),A.onAfterShadow(i,A,x,T,D,rt,j)}}}else if(W.visible){let J=E(A,W,V,L);A.onBeforeShadow(i,A,x,T,D,J,null),i.renderBufferDirect(T,null,D,J,A,null),A.onAfterShadow(i,A,x,T,D,J,null)}}let q=A.children;for(let D=0,W=q.length;D<W;D++)b(q[D],x,T,V,N,L)}function I(A){A.target.removeEventListener("dispose",I);for(let T in c){let V=c[T],N=A.target.uuid;N in V&&(V[N].dispose(),delete V[N])}}}function PM(i,t){function e(){let U=!1,ot=new Ie,it=null,Tt=new Ie(0,0,0,0);return{setMask:function(_t){it!==_t&&!U&&(i.colorMask(_t,_t,_t,_t),it=_t)},setLocked:function(_t){U=_t},setClear:function(_t,bt,Wt,Qt,ct){ct===!0&&(_t*=Qt,bt*=Qt,Wt*=Qt),ot.set(_t,bt,Wt,Qt),Tt.equals(ot)===!1&&(i.clearColor(_t,bt,Wt,Qt),Tt.copy(ot))},reset:function(){U=!1,it=null,Tt.set(-1,0,0,0)}}}function n(){let U=!1,ot=!1,it=null,Tt=null,_t=null;return{setReversed:function(bt){if(ot!==bt){let Wt=t.get("EXT_clip_control");bt?Wt.clipControlEXT(Wt.LOWER_LEFT_EXT,Wt.ZERO_TO_ONE_EXT):Wt.clipControlEXT(Wt.LOWER_LEFT_EXT,Wt.NEGATIVE_ONE_TO_ONE_EXT),ot=bt;let Qt=_t;_t=null,this.setClear(Qt)}},getReversed:function(){return ot},setTest:function(bt){bt?Mt(i.DEPTH_TEST):Xt(i.DEPTH_TEST)},setMask:function(bt){it!==bt&&!U&&(i.depthMask(bt),it=bt)},setFunc:function(bt){if(ot&&(bt=Gm[bt]),Tt!==bt){switch(bt){case lc:i.depthFunc(i.NEVER);break;case cc:i.depthFunc(i.ALWAYS);break;case hc:i.depthFunc(i.LESS);break;case bo:i.depthFunc(i.LEQUAL);break;case uc:i.depthFunc(i.EQUAL);break;case dc:i.depthFunc(i.GEQUAL);break;case fc:i.depthFunc(i.GREATER);break;case pc:i.depthFunc(i.NOTEQUAL);break;default:i.depthFunc(i.LEQUAL)}Tt=bt}},setLocked:function(bt){U=bt},setClear:function(bt){_t!==bt&&(_t=bt,ot&&(bt=1-bt),i.clearDepth(bt))},reset:function(){U=!1,it=null,Tt=null,_t=null,ot=!1}}}function s(){let U=!1,ot=null,it=null,Tt=null,_t=null,bt=null,Wt=null,Qt=null,ct=null;return{setTest:function(kt){U||(kt?Mt(i.STENCIL_TEST):Xt(i.STENCIL_TEST))},setMask:function(kt){ot!==kt&&!U&&(i.stencilMask(kt),ot=kt)},setFunc:function(kt,te,Rt){(it!==kt||Tt!==te||_t!==Rt)&&(i.stencilFunc(kt,te,Rt),it=kt,Tt=te,_t=Rt)},setOp:function(kt,te,Rt){(bt!==kt||Wt!==te||Qt!==Rt)&&(i.stencilOp(kt,te,Rt),bt=kt,Wt=te,Qt=Rt)},setLocked:function(kt){U=kt},setClear:function(kt){ct!==kt&&(i.clearStencil(kt),ct=kt)},reset:function(){U=!1,ot=null,it=null,Tt=null,_t=null,bt=null,Wt=null,Qt=null,ct=null}}}let r=new e,o=new n,a=new s,l={},c=new WeakMap,u={},h={},d={},f=new WeakMap,m=[],y=null,p=!1,g=null,v=null,E=null,b=null,I=null,A=null,x=null,T=new he(0,0,0),V=0,N=!1,L=null,X=null,q=null,D=null,W=null,J=i.getParameter(i.MAX_COMBINED_TEXTURE_IMAGE_UNITS),H=!1,ht=0,j=i.getParameter(i.VERSION);j.indexOf("WebGL")!==-1?(ht=parseFloat(/^WebGL (\d)/.exec(j)[1]),H=ht>=1):j.indexOf("OpenGL ES")!==-1&&(ht=parseFloat(/^OpenGL ES (\d)/.exec(j)[1]),H=ht>=2);let tt=null,rt={},ft=i.getParameter(i.SCISSOR_BOX),dt=i.getParameter(i.VIEWPORT),et=new Ie().fromArray(ft),gt=new Ie().fromArray(dt);function yt(U,ot,it,Tt){let _t=new Uint8Array(4),bt=i.createTexture();i.bindTexture(U,bt),i.texParameteri(U,i.TEXTURE_MIN_FILTER,i.NEAREST),i.texParameteri(U,i.TEXTURE_MAG_FILTER,i.NEAREST);for(let Wt=0;Wt<it;Wt++)U===i.TEXTURE_3D||U===i.TEXTURE_2D_ARRAY?i.texImage3D(ot,0,i.RGBA,1,1,Tt,0,i.RGBA,i.UNSIGNED_BYTE,_t):i.texImage2D(ot+Wt,0,i.RGBA,1,1,0,i.RGBA,i.UNSIGNED_BYTE,_t);return bt}let Ct={};Ct[i.TEXTURE_2D]=yt(i.TEXTURE_2D,i.TEXTURE_2D,1),Ct[i.TEXTURE_CUBE_MAP]=yt(i.TEXTURE_CUBE_MAP,i.TEXTURE_CUBE_MAP_POSITIVE_X,6),Ct[i.TEXTURE_2D_ARRAY]=yt(i.TEXTURE_2D_ARRAY,i.TEXTURE_2D_ARRAY,1,1),Ct[i.TEXTURE_3D]=yt(i.TEXTURE_3D,i.TEXTURE_3D,1,1),r.setClear(0,0,0,1),o.setClear(1),a.setClear(0),Mt(i.DEPTH_TEST),o.setFunc(bo),an(!1),Ue(ld),Mt(i.CULL_FACE),$e(Ar);function Mt(U){u[U]!==!0&&(i.enable(U),u[U]=!0)}function Xt(U){u[U]!==!1&&(i.disable(U),u[U]=!1)}function oe(U,ot){return d[U]!==ot?(i.bindFramebuffer(U,ot),d[U]=ot,U===i.DRAW_FRAMEBUFFER&&(d[i.FRAMEBUFFER]=ot),U===i.FRAMEBUFFER&&(d[i.DRAW_FRAMEBUFFER]=ot),!0):!1}function Ht(U,ot){let it=m,Tt=!1;if(U){it=f.get(ot),it===void 0&&(it=[],f.set(ot,it));let _t=U.textures;if(it.length!==_t.length||it[0]!==i.COLOR_ATTACHMENT0){for(let bt=0,Wt=_t.length;bt<Wt;bt++)it[bt]=i.COLOR_ATTACHMENT0+bt;it.length=_t.length,Tt=!0}}else it[0]!==i.BACK&&(it[0]=i.BACK,Tt=!0);Tt&&i.drawBuffers(it)}function pe(U){return y!==U?(i.useProgram(U),y=U,!0):!1}let ue={[Er]:i.FUNC_ADD,[um]:i.FUNC_SUBTRACT,[dm]:i.FUNC_REVERSE_SUBTRACT};ue[fm]=i.MIN,ue[pm]=i.MAX;let se={[mm]:i.ZERO,[gm]:i.ONE,[_m]:i.SRC_COLOR,[dd]:i.SRC_ALPHA,[Mm]:i.SRC_ALPHA_SATURATE,[Sm]:i.DST_COLOR,[ym]:i.DST_ALPHA,[xm]:i.ONE_MINUS_SRC_COLOR,[fd]:i.ONE_MINUS_SRC_ALPHA,[bm]:i.ONE_MINUS_DST_COLOR,[vm]:i.ONE_MINUS_DST_ALPHA,[wm]:i.CONSTANT_COLOR,[Tm]:i.ONE_MINUS_CONSTANT_COLOR,[Am]:i.CONSTANT_ALPHA,[Em]:i.ONE_MINUS_CONSTANT_ALPHA};function $e(U,ot,it,Tt,_t,bt,Wt,Qt,ct,kt){if(U===Ar){p===!0&&(Xt(i.BLEND),p=!1);return}if(p===!1&&(Mt(i.BLEND),p=!0),U!==hm){if(U!==g||kt!==N){if((v!==Er||I!==Er)&&(i.blendEquation(i.FUNC_ADD),v=Er,I=Er),kt)switch(U){case Bo:i.blendFuncSeparate(i.ONE,i.ONE_MINUS_SRC_ALPHA,i.ONE,i.ONE_MINUS_SRC_ALPHA);break;case cd:i.blendFunc(i.ONE,i.ONE);break;case hd:i.blendFuncSeparate(i.ZERO,i.ONE_MINUS_SRC_COLOR,i.ZERO,i.ONE);break;case ud:i.blendFuncSeparate(i.DST_COLOR,i.ONE_MINUS_SRC_ALPHA,i.ZERO,i.ONE);break;default:ee("WebGLState: Invalid blending: ",U);break}else switch(U){case Bo:i.blendFuncSeparate(i.SRC_ALPHA,i.ONE_MINUS_SRC_ALPHA,i.ONE,i.ONE_MINUS_SRC_ALPHA);break;case cd:i.blendFuncSeparate(i.SRC_ALPHA,i.ONE,i.ONE,i.ONE);break;case hd:ee("WebGLState: SubtractiveBlending requires material.premultipliedAlpha = true");break;case ud:ee("WebGLState: MultiplyBlending requires material.premultipliedAlpha = true");break;default:ee("WebGLState: Invalid blending: ",U);break}E=null,b=null,A=null,x=null,T.set(0,0,0),V=0,g=U,N=kt}return}_t=_t||ot,bt=bt||it,Wt=Wt||Tt,(ot!==v||_t!==I)&&(i.blendEquationSeparate(ue[ot],ue[_t]),v=ot,I=_t),(it!==E||Tt!==b||bt!==A||Wt!==x)&&(i.blendFuncSeparate(se[it],se[Tt],se[bt],se[Wt]),E=it,b=Tt,A=bt,x=Wt),(Qt.equals(T)===!1||ct!==V)&&(i.blendColor(Qt.r,Qt.g,Qt.b,ct),T.copy(Qt),V=ct),g=U,N=!1}function Ve(U,ot){U.side===ri?Xt(i.CULL_FACE):Mt(i.CULL_FACE);let it=U.side===ni;ot&&(it=!it),an(it),U.blending===Bo&&U.transparent===!1?$e(Ar):$e(U.blending,U.blendEquation,U.blendSrc,U.blendDst,U.blendEquationAlpha,U.blendSrcAlpha,U.blendDstAlpha,U.blendColor,U.blendAlpha,U.premultipliedAlpha),o.setFunc(U.depthFunc),o.setTest(U.depthTest),o.setMask(U.depthWrite),r.setMask(U.colorWrite);let Tt=U.stencilWrite;a.setTest(Tt),Tt&&(a.setMask(U.stencilWriteMask),a.setFunc(U.stencilFunc,U.stencilRef,U.stencilFuncMask),a.setOp(U.stencilFail,U.stencilZFail,U.stencilZPass)),Se(U.polygonOffset,U.polygonOffsetFactor,U.polygonOffsetUnits),U.alphaToCoverage===!0?Mt(i.SAMPLE_ALPHA_TO_COVERAGE):Xt(i.SAMPLE_ALPHA_TO_COVERAGE)}function an(U){L!==U&&(U?i.frontFace(i.CW):i.frontFace(i.CCW),L=U)}function Ue(U){U!==am?(Mt(i.CULL_FACE),U!==X&&(U===ld?i.cullFace(i.BACK):U===lm?i.cullFace(i.FRONT):i.cullFace(i.FRONT_AND_BACK))):Xt(i.CULL_FACE),X=U}function En(U){U!==q&&(H&&i.lineWidth(U),q=U)}function Se(U,ot,it){U?(Mt(i.POLYGON_OFFSET_FILL),(D!==ot||W!==it)&&(D=ot,W=it,o.getReversed()&&(ot=-ot,it=-it),i.polygonOffset(ot,it))):Xt(i.POLYGON_OFFSET_FILL)}function xn(U){U?Mt(i.SCISSOR_TEST):Xt(i.SCISSOR_TEST)}function je(U){U===void 0&&(U=i.TEXTURE0+J-1),tt!==U&&(i.activeTexture(U),tt=U)}function ln(U,ot,it){it===void 0&&(tt===null?it=i.TEXTURE0+J-1:it=tt);let Tt=rt[it];Tt===void 0&&(Tt={type:void 0,texture:void 0},rt[it]=Tt),(Tt.type!==U||Tt.texture!==ot)&&(tt!==it&&(i.activeTexture(it),tt=it),i.bindTexture(U,ot||Ct[U]),Tt.type=U,Tt.texture=ot)}function O(){let U=rt[tt];U!==void 0&&U.type!==void 0&&(i.bindTexture(U.type,null),U.type=void 0,U.texture=void 0)}function It(){try{i.compressedTexImage2D(...arguments)}catch(U){ee("WebGLState:",U)}}function Kt(){try{i.compressedTexImage3D(...arguments)}catch(U){ee("WebGLState:",U)}}function ae(){try{i.texSubImage2D(...arguments)}catch(U){ee("WebGLState:",U)}}function wt(){try{i.texSubImage3D(...arguments)}catch(U){ee("WebGLState:",U)}}function Be(){try{i.compressedTexSubImage2D(...arguments)}catch(U){ee("WebGLState:",U)}}function Gt(){try{i.compressedTexSubImage3D(...arguments)}catch(U){ee("WebGLState:",U)}}function Yt(){try{i.texStorage2D(...arguments)}catch(U){ee("WebGLState:",U)}}function C(){try{i.texStorage3D(...arguments)}catch(U){ee("WebGLState:",U)}}function S(){try{i.texImage2D(...arguments)}catch(U){ee("WebGLState:",U)}}function Y(){try{i.texImage3D(...arguments)}catch(U){ee("WebGLState:",U)}}function ut(U){return h[U]!==void 0?h[U]:i.getParameter(U)}function at(U,ot){h[U]!==ot&&(i.pixelStorei(U,ot),h[U]=ot)}function xt(U){et.equals(U)===!1&&(i.scissor(U.x,U.y,U.z,U.w),et.copy(U))}function vt(U){gt.equals(U)===!1&&(i.viewport(U.x,U.y,U.z,U.w),gt.copy(U))}function nt(U,ot){let it=c.get(ot);it===void 0&&(it=new WeakMap,c.set(ot,it));let Tt=it.get(U);Tt===void 0&&(Tt=i.getUniformBlockIndex(ot,U.name),i.uniformBlockBinding(ot,Tt,Tt),it.set(U,Tt))}function st(U,ot,it){let _t=c.get(ot).get(U);l[_t]!==it&&(i.bindBufferBase(i.UNIFORM_BUFFER,_t,it),l[_t]=it)}function mt(){i.disable(i.BLEND),i.disable(i.CULL_FACE),i.disable(i.DEPTH_TEST),i.disable(i.POLYGON_OFFSET_FILL),i.disable(i.SCISSOR_TEST),i.disable(i.STENCIL_TEST),i.disable(i.SAMPLE_ALPHA_TO_COVERAGE),i.blendEquation(i.FUNC_ADD),i.blendFunc(i.ONE,i.ZERO),i.blendFuncSeparate(i.ONE,i.ZERO,i.ONE,i.ZERO),i.blendColor(0,0,0,0),i.colorMask(!0,!0,!0,!0),i.clearColor(0,0,0,0),i.depthMask(!0),i.depthFunc(i.LESS),o.setReversed(!1),i.clearDepth(1),i.stencilMask(4294967295),i.stencilFunc(i.ALWAYS,0,4294967295),i.stencilOp(i.KEEP,i.KEEP,i.KEEP),i.clearStencil(0),i.cullFace(i.BACK),i.frontFace(i.CCW),i.polygonOffset(0,0),i.activeTexture(i.TEXTURE0),i.bindFramebuffer(i.FRAMEBUFFER,null),i.bindFramebuffer(i.DRAW_FRAMEBUFFER,null),i.bindFramebuffer(i.READ_FRAMEBUFFER,null),i.useProgram(null),i.lineWidth(1),i.scissor(0,0,i.canvas.width,i.canvas.height),i.viewport(0,0,i.canvas.width,i.canvas.height),i.pixelStorei(i.PACK_ALIGNMENT,4),i.pixelStorei(i.UNPACK_ALIGNMENT,4),i.pixelStorei(i.UNPACK_FLIP_Y_WEBGL,!1),i.pixelStorei(i.UNPACK_PREMULTIPLY_ALPHA_WEBGL,!1),i.pixelStorei(i.UNPACK_COLORSPACE_CONVERSION_WEBGL,i.BROWSER_DEFAULT_WEBGL),i.pixelStorei(i.PACK_ROW_LENGTH,0),i.pixelStorei(i.PACK_SKIP_PIXELS,0),i.pixelStorei(i.PACK_SKIP_ROWS,0),i.pixelStorei(i.UNPACK_ROW_LENGTH,0),i.pixelStorei(i.UNPACK_IMAGE_HEIGHT,0),i.pixelStorei(i.UNPACK_SKIP_PIXELS,0),i.pixelStorei(i.UNPACK_SKIP_ROWS,0),i.pixelStorei(i.UNPACK_SKIP_IMAGES,0),u={},h={},tt=null,rt={},d={},l={},f=new WeakMap,m=[],y=null,p=!1,g=null,v=null,E=null,b=null,I=null,A=null,x=null,T=new he(0,0,0),V=0,N=!1,L=null,X=null,q=null,D=null,W=null,et.set(0,0,i.canvas.width,i.canvas.height),gt.set(0,0,i.canvas.width,i.canvas.height),r.reset(),o.reset(),a.reset()}return{buffers:{color:r,depth:o,stencil:a},enable:Mt,disable:Xt,bindFramebuffer:oe,drawBuffers:Ht,useProgram:pe,setBlending:$e,setMaterial:Ve,setFlipSided:an,setCullFace:Ue,setLineWidth:En,setPolygonOffset:Se,setScissorTest:xn,activeTexture:je,bindTexture:ln,unbindTexture:O,compressedTexImage2D:It,compressedTexImage3D:Kt,texImage2D:S,texImage3D:Y,pixelStorei:at,getParameter:ut,updateUBOMapping:nt,uniformBlockBinding:st,texStorage2D:Yt,texStorage3D:C,texSubImage2D:ae,texSubImage3D:wt,compressedTexSubImage2D:Be,compressedTexSubImage3D:Gt,scissor:xt,viewport:vt,reset:mt}}function LM(i,t,e,n,s,r,o){let a=t.has("WEBGL_multisampled_render_to_texture")?t.get("WEBGL_multisampled_render_to_texture"):null,l=typeof navigator>"u"?!1:/OculusBrowser/g.test(navigator.userAgent),c=new Zt,u=new WeakMap,h=new Set,d,f=new WeakMap,m=new Set,y=new FinalizationRegistry(C=>m.delete(C)),p=!1;try{p=typeof OffscreenCanvas<"u"&&new OffscreenCanvas(1,1).getContext("2d")!==null}catch{}function g(C,S){return p?new OffscreenCanvas(C,S):wa("canvas")}function v(C,S,Y){let ut=1,at=Yt(C);if((at.width>Y||at.height>Y)&&(ut=Y/Math.max(at.width,at.height)),ut<1)if(typeof HTMLImageElement<"u"&&C instanceof HTMLImageElement||typeof HTMLCanvasElement<"u"&&C instanceof HTMLCanvasElement||typeof ImageBitmap<"u"&&C instanceof ImageBitmap||typeof VideoFrame<"u"&&C instanceof VideoFrame){let xt=Math.floor(ut*at.width),vt=Math.floor(ut*at.height);d===void 0&&(d=g(xt,vt));let nt=S?g(xt,vt):d;return nt.width=xt,nt.height=vt,nt.getContext("2d").drawImage(C,0,0,xt,vt),$t("WebGLRenderer: Texture has been resized from ("+at.width+"x"+at.height+") to ("+xt+"x"+vt+")."),nt}else return"data"in C&&$t("WebGLRenderer: Image in DataTexture is too big ("+at.width+"x"+at.height+")."),C;return C}function E(C){return C.generateMipmaps}function b(C){i.generateMipmap(C)}function I(C){return C.isWebGLCubeRenderTarget?i.TEXTURE_CUBE_MAP:C.isWebGL3DRenderTarget?i.TEXTURE_3D:C.isWebGLArrayRenderTarget||C.isCompressedArrayTexture?i.TEXTURE_2D_ARRAY:i.TEXTURE_2D}function A(C,S,Y,ut,at,xt=!1){if(C!==null){if(i[C]!==void 0)return i[C];$t("WebGLRenderer: Attempt to use non-existing WebGL internal format '"+C+"'")}let vt;ut&&(vt=t.get("EXT_texture_norm16"),vt||$t("WebGLRenderer: Unable to use normalized textures without EXT_texture_norm16 extension"));let nt=S;if(S===i.RED&&(Y===i.FLOAT&&(nt=i.R32F),Y===i.HALF_FLOAT&&(nt=i.R16F),Y===i.UNSIGNED_BYTE&&(nt=i.R8),Y===i.UNSIGNED_SHORT&&vt&&(nt=vt.R16_EXT),Y===i.SHORT&&vt&&(nt=vt.R16_SNORM_EXT)),S===i.RED_INTEGER&&(Y===i.UNSIGNED_BYTE&&(nt=i.R8UI),Y===i.UNSIGNED_SHORT&&(nt=i.R16UI),Y===i.UNSIGNED_INT&&(nt=i.R32UI),Y===i.BYTE&&(nt=i.R8I),Y===i.SHORT&&(nt=i.R16I),Y===i.INT&&(nt=i.R32I)),S===i.RG&&(Y===i.FLOAT&&(nt=i.RG32F),Y===i.HALF_FLOAT&&(nt=i.RG16F),Y===i.UNSIGNED_BYTE&&(nt=i.RG8),Y===i.UNSIGNED_SHORT&&vt&&(nt=vt.RG16_EXT),Y===i.SHORT&&vt&&(nt=vt.RG16_SNORM_EXT)),S===i.RG_INTEGER&&(Y===i.UNSIGNED_BYTE&&(nt=i.RG8UI),Y===i.UNSIGNED_SHORT&&(nt=i.RG16UI),Y===i.UNSIGNED_INT&&(nt=i.RG32UI),Y===i.BYTE&&(nt=i.RG8I),Y===i.SHORT&&(nt=i.RG16I),Y===i.INT&&(nt=i.RG32I)),S===i.RGB_INTEGER&&(Y===i.UNSIGNED_BYTE&&(nt=i.RGB8UI),Y===i.UNSIGNED_SHORT&&(nt=i.RGB16UI),Y===i.UNSIGNED_INT&&(nt=i.RGB32UI),Y===i.BYTE&&(nt=i.RGB8I),Y===i.SHORT&&(nt=i.RGB16I),Y===i.INT&&(nt=i.RGB32I)),S===i.RGBA_INTEGER&&(Y===i.UNSIGNED_BYTE&&(nt=i.RGBA8UI),Y===i.UNSIGNED_SHORT&&(nt=i.RGBA16UI),Y===i.UNSIGNED_INT&&(nt=i.RGBA32UI),Y===i.BYTE&&(nt=i.RGBA8I),Y===i.SHORT&&(nt=i.RGBA16I),Y===i.INT&&(nt=i.RGBA32I)),S===i.RGB&&(Y===i.UNSIGNED_SHORT&&vt&&(nt=vt.RGB16_EXT),Y===i.SHORT&&vt&&(nt=vt.RGB16_SNORM_EXT),Y===i.UNSIGNED_INT_5_9_9_9_REV&&(nt=i.RGB9_E5),Y===i.UNSIGNED_INT_10F_11F_11F_REV&&(nt=i.R11F_G11F_B10F)),S===i.RGBA){let st=xt?Ma:ye.getTransfer(at);Y===i.FLOAT&&(nt=i.RGBA32F),Y===i.HALF_FLOAT&&(nt=i.RGBA16F),Y===i.UNSIGNED_BYTE&&(nt=st===Re?i.SRGB8_ALPHA8:i.RGBA8),Y===i.UNSIGNED_SHORT&&vt&&(nt=vt.RGBA16_EXT),Y===i.SHORT&&vt&&(nt=vt.RGBA16_SNORM_EXT),Y===i.UNSIGNED_SHORT_4_4_4_4&&(nt=i.RGBA4),Y===i.UNSIGNED_SHORT_5_5_5_1&&(nt=i.RGB5_A1)}return(nt===i.R16F||nt===i.R32F||nt===i.RG16F||nt===i.RG32F||nt===i.RGBA16F||nt===i.RGBA32F)&&t.get("EXT_color_buffer_float"),nt}function x(C,S){let Y;return C?S===null||S===Gi||S===Rr?Y=i.DEPTH24_STENCIL8:S===Hi?Y=i.DEPTH32F_STENCIL8:S===zo&&(Y=i.DEPTH24_STENCIL8,$t("DepthTexture: 16 bit depth attachment is not supported with stencil. Using 24-bit attachment.")):S===null||S===Gi||S===Rr?Y=i.DEPTH_COMPONENT24:S===Hi?Y=i.DEPTH_COMPONENT32F:S===zo&&(Y=i.DEPTH_COMPONENT16),Y}function T(C,S){return E(C)===!0||C.isFramebufferTexture&&C.minFilter!==mn&&C.minFilter!==ti?Math.log2(Math.max(S.width,S.height))+1:C.mipmaps.length>0?C.mipmaps.length:C.isCompressedTexture&&Array.isArray(C.image)?S.mipmaps.length:1}function V(C){let S=new WeakRef(C);n.get(C).__ref=S,m.add(S),y.register(C,S,S)}function N(C){let S=n.get(C).__ref;S!==void 0&&(m.delete(S),y.unregister(S))}function L(C){q(C.target)}function X(C){D(C.target)}function q(C){C.removeEventListener("dispose",L),N(C),J(C),C.isVideoTexture&&u.delete(C),C.isHTMLTexture&&h.delete(C)}function D(C){C.removeEventListener("dispose",X),N(C),ht(C)}function W(){for(let C of m){let S=C.deref();S!==void 0&&(S.isRenderTarget===!0?D(S):q(S))}m.clear(),h.clear()}function J(C){let S=n.get(C);if(S.__webglInit===void 0)return;let Y=C.source,ut=f.get(Y);if(ut){let at=ut[S.__cacheKey];at.usedTimes--,at.usedTimes===0&&H(C),Object.keys(ut).length===0&&f.delete(Y)}n.remove(C)}function H(C){let S=n.get(C);i.deleteTexture(S.__webglTexture);let Y=C.source,ut=f.get(Y);delete ut[S.__cacheKey],o.memory.textures--}function ht(C){let S=n.get(C);S.__depthDisposeCallback&&S.__depthDisposeCallback();let Y=C.depthTexture;if(Y&&Y.renderTarget===C&&q(Y),C.isWebGLCubeRenderTarget)for(let at=0;at<6;at++){if(Array.isArray(S.__webglFramebuffer[at]))for(let xt=0;xt<S.__webglFramebuffer[at].length;xt++)i.deleteFramebuffer(S.__webglFramebuffer[at][xt]);else i.deleteFramebuffer(S.__webglFramebuffer[at]);S.__webglDepthbuffer&&i.deleteRenderbuffer(S.__webglDepthbuffer[at])}else{if(Array.isArray(S.__webglFramebuffer))for(let at=0;at<S.__webglFramebuffer.length;at++)i.deleteFramebuffer(S.__webglFramebuffer[at]);else i.deleteFramebuffer(S.__webglFramebuffer);if(S.__webglDepthbuffer&&i.deleteRenderbuffer(S.__webglDepthbuffer),S.__webglMultisampledFramebuffer&&i.deleteFramebuffer(S.__webglMultisampledFramebuffer),S.__webglColorRenderbuffer)for(let at=0;at<S.__webglColorRenderbuffer.length;at++)S.__webglColorRenderbuffer[at]&&i.deleteRenderbuffer(S.__webglColorRenderbuffer[at]);S.__webglDepthRenderbuffer&&i.deleteRenderbuffer(S.__webglDepthRenderbuffer)}let ut=C.textures;for(let at=0,xt=ut.length;at<xt;at++){let vt=n.get(ut[at]);vt.__webglTexture&&(i.deleteTexture(vt.__webglTexture),o.memory.textures--),n.remove(ut[at])}n.remove(C)}let j=0;function tt(){j=0}function rt(){return j}function ft(C){j=C}function dt(){let C=j;return C>=s.maxTextures&&$t("WebGLTextures: Trying to use "+(C+1)+" texture units while this GPU supports only "+s.maxTextures),j+=1,C}function et(C){let S=[];return S.push(C.wrapS),S.push(C.wrapT),S.push(C.wrapR||0),S.push(C.magFilter),S.push(C.minFilter),S.push(C.anisotropy),S.push(C.internalFormat),S.push(C.format),S.push(C.type),S.push(C.generateMipmaps),S.push(C.mipmapsAutoUpdate),S.push(C.premultiplyAlpha),S.push(C.flipY),S.push(C.unpackAlignment),S.push(C.colorSpace),S.join()}function gt(C,S){let Y=n.get(C);if(C.isVideoTexture&&Be(C),C.isRenderTargetTexture===!1&&C.isExternalTexture!==!0&&C.version>0&&Y.__version!==C.version){let ut=C.image;if(ut===null)$t("WebGLRenderer: Texture marked for update but no image data found.");else if(ut.complete===!1)$t("WebGLRenderer: Texture marked for update but image is incomplete");else{Ve(Y,C,S);return}}else C.isExternalTexture&&(Y.__webglTexture=C.sourceTexture?C.sourceTexture:null);e.bindTexture(i.TEXTURE_2D,Y.__webglTexture,i.TEXTURE0+S)}function yt(C,S){let Y=n.get(C);if(C.isRenderTargetTexture===!1&&C.version>0&&Y.__version!==C.version){Ve(Y,C,S);return}else C.isExternalTexture&&(Y.__webglTexture=C.sourceTexture?C.sourceTexture:null);e.bindTexture(i.TEXTURE_2D_ARRAY,Y.__webglTexture,i.TEXTURE0+S)}function Ct(C,S){let Y=n.get(C);if(C.isRenderTargetTexture===!1&&C.version>0&&Y.__version!==C.version){Ve(Y,C,S);return}e.bindTexture(i.TEXTURE_3D,Y.__webglTexture,i.TEXTURE0+S)}function Mt(C,S){let Y=n.get(C);if(C.version>0&&Y.__version!==C.version){an(Y,C,S);return}e.bindTexture(i.TEXTURE_CUBE_MAP,Y.__webglTexture,i.TEXTURE0+S)}let Xt={[mc]:i.REPEAT,[ls]:i.CLAMP_TO_EDGE,[gc]:i.MIRRORED_REPEAT},oe={[mn]:i.NEAREST,[Im]:i.NEAREST_MIPMAP_NEAREST,[Xa]:i.NEAREST_MIPMAP_LINEAR,[ti]:i.LINEAR,[Wc]:i.LINEAR_MIPMAP_NEAREST,[Us]:i.LINEAR_MIPMAP_LINEAR},Ht={[Nm]:i.NEVER,[Pd]:i.ALWAYS,[Um]:i.LESS,[Rd]:i.LEQUAL,[Om]:i.EQUAL,[Id]:i.GEQUAL,[Fm]:i.GREATER,[Bm]:i.NOTEQUAL};function pe(C,S){if(S.type===Hi&&t.has("OES_texture_float_linear")===!1&&(S.magFilter===ti||S.magFilter===Wc||S.magFilter===Xa||S.magFilter===Us||S.minFilter===ti||S.minFilter===Wc||S.minFilter===Xa||S.minFilter===Us)&&$t("WebGLRenderer: Unable to use linear filtering with floating point textures. OES_texture_float_linear not supported on this device."),i.texParameteri(C,i.TEXTURE_WRAP_S,Xt[S.wrapS]),i.texParameteri(C,i.TEXTURE_WRAP_T,Xt[S.wrapT]),(C===i.TEXTURE_3D||C===i.TEXTURE_2D_ARRAY)&&i.texParameteri(C,i.TEXTURE_WRAP_R,Xt[S.wrapR]),i.texParameteri(C,i.TEXTURE_MAG_FILTER,oe[S.magFilter]),i.texParameteri(C,i.TEXTURE_MIN_FILTER,oe[S.minFilter]),S.compareFunction&&(i.texParameteri(C,i.TEXTURE_COMPARE_MODE,i.COMPARE_REF_TO_TEXTURE),i.texParameteri(C,i.TEXTURE_COMPARE_FUNC,Ht[S.compareFunction])),t.has("EXT_texture_filter_anisotropic")===!0){if(S.magFilter===mn||S.minFilter!==Xa&&S.minFilter!==Us||S.type===Hi&&t.has("OES_texture_float_linear")===!1)return;if(S.anisotropy>1||n.get(S).__currentAnisotropy){let Y=t.get("EXT_texture_filter_anisotropic");i.texParameterf(C,Y.TEXTURE_MAX_ANISOTROPY_EXT,Math.min(S.anisotropy,s.getMaxAnisotropy())),n.get(S).__currentAnisotropy=S.anisotropy}}}function ue(C,S){let Y=!1;C.__webglInit===void 0&&(C.__webglInit=!0,S.addEventListener("dispose",L),V(S));let ut=S.source,at=f.get(ut);at===void 0&&(at={},f.set(ut,at));let xt=et(S);if(xt!==C.__cacheKey){at[xt]===void 0&&(at[xt]={texture:i.createTexture(),usedTimes:0},o.memory.textures++,Y=!0),at[xt].usedTimes++;let vt=at[C.__cacheKey];vt!==void 0&&(at[C.__cacheKey].usedTimes--,vt.usedTimes===0&&H(S)),C.__cacheKey=xt,C.__webglTexture=at[xt].texture}return Y}function se(C,S,Y){return Math.floor(Math.floor(C/Y)/S)}function $e(C,S,Y,ut){let xt=C.updateRanges;if(xt.length===0)e.texSubImage2D(i.TEXTURE_2D,0,0,0,S.width,S.height,Y,ut,S.data);else{xt.sort((U,ot)=>U.start-ot.start);let vt=0;for(let U=1;U<xt.length;U++){let ot=xt[vt],it=xt[U],Tt=ot.start+ot.count,_t=se(it.start,S.width,4),bt=se(ot.start,S.width,4);it.start<=Tt+1&&_t===bt&&se(it.start+it.count-1,S.width,4)===_t?ot.count=Math.max(ot.count,it.start+it.count-ot.start):(++vt,xt[vt]=it)}xt.length=vt+1;let nt=e.getParameter(i.UNPACK_ROW_LENGTH),st=e.getParameter(i.UNPACK_SKIP_PIXELS),mt=e.getParameter(i.UNPACK_SKIP_ROWS);e.pixelStorei(i.UNPACK_ROW_LENGTH,S.width);for(let U=0,ot=xt.length;U<ot;U++){let it=xt[U],Tt=Math.floor(it.start/4),_t=Math.ceil(it.count/4),bt=Tt%S.width,Wt=Math.floor(Tt/S.width),Qt=_t,ct=1;e.pixelStorei(i.UNPACK_SKIP_PIXELS,bt),e.pixelStorei(i.UNPACK_SKIP_ROWS,Wt),e.texSubImage2D(i.TEXTURE_2D,0,bt,Wt,Qt,ct,Y,ut,S.data)}C.clearUpdateRanges(),e.pixelStorei(i.UNPACK_ROW_LENGTH,nt),e.pixelStorei(i.UNPACK_SKIP_PIXELS,st),e.pixelStorei(i.UNPACK_SKIP_ROWS,mt)}}function Ve(C,S,Y){let ut=i.TEXTURE_2D;(S.isDataArrayTexture||S.isCompressedArrayTexture)&&(ut=i.TEXTURE_2D_ARRAY),S.isData3DTexture&&(ut=i.TEXTURE_3D);let at=ue(C,S),xt=S.source;e.bindTexture(ut,C.__webglTexture,i.TEXTURE0+Y);let vt=n.get(xt);if(xt.version!==vt.__version||at===!0){if(e.activeTexture(i.TEXTURE0+Y),(typeof ImageBitmap<"u"&&S.image instanceof ImageBitmap)===!1){let ct=ye.getPrimaries(ye.workingColorSpace),kt=S.colorSpace===Fs?null:ye.getPrimaries(S.colorSpace),te=S.colorSpace===Fs||ct===kt?i.NONE:i.BROWSER_DEFAULT_WEBGL;e.pixelStorei(i.UNPACK_FLIP_Y_WEBGL,S.flipY),e.pixelStorei(i.UNPACK_PREMULTIPLY_ALPHA_WEBGL,S.premultiplyAlpha),e.pixelStorei(i.UNPACK_COLORSPACE_CONVERSION_WEBGL,te)}e.pixelStorei(i.UNPACK_ALIGNMENT,S.unpackAlignment);let st=v(S.image,!1,s.maxTextureSize);st=Gt(S,st);let mt=r.convert(S.format,S.colorSpace),U=r.convert(S.type),ot=A(S.internalFormat,mt,U,S.normalized,S.colorSpace,S.isVideoTexture);pe(ut,S);let it,Tt=S.mipmaps,_t=S.isVideoTexture!==!0,bt=vt.__version===void 0||at===!0,Wt=xt.dataReady,Qt=T(S,st);if(S.isDepthTexture)ot=x(S.format===Os,S.type),bt&&(_t?e.texStorage2D(i.TEXTURE_2D,1,ot,st.width,st.height):e.texImage2D(i.TEXTURE_2D,0,ot,st.width,st.height,0,mt,U,null));else if(S.isDataTexture)if(Tt.length>0){_t&&bt&&e.texStorage2D(i.TEXTURE_2D,Qt,ot,Tt[0].width,Tt[0].height);for(let ct=0,kt=Tt.length;ct<kt;ct++)it=Tt[ct],_t?Wt&&e.texSubImage2D(i.TEXTURE_2D,ct,0,0,it.width,it.height,mt,U,it.data):e.texImage2D(i.TEXTURE_2D,ct,ot,it.width,it.height,0,mt,U,it.data);S.generateMipmaps=!1}else _t?(bt&&e.texStorage2D(i.TEXTURE_2D,Qt,ot,st.width,st.height),Wt&&$e(S,st,mt,U)):e.texImage2D(i.TEXTURE_2D,0,ot,st.width,st.height,0,mt,U,st.data);else if(S.isCompressedTexture)if(S.isCompressedArrayTexture){_t&&bt&&e.texStorage3D(i.TEXTURE_2D_ARRAY,Qt,ot,Tt[0].width,Tt[0].height,st.depth);for(let ct=0,kt=Tt.length;ct<kt;ct++)if(it=Tt[ct],S.format!==Xi)if(mt!==null)if(_t){if(Wt)if(S.layerUpdates.size>0){let te=Vd(it.width,it.height,S.format,S.type);for(let Rt of S.layerUpdates){let ce=it.data.subarray(Rt*te/it.data.BYTES_PER_ELEMENT,(Rt+1)*te/it.data.BYTES_PER_ELEMENT);e.compressedTexSubImage3D(i.TEXTURE_2D_ARRAY,ct,0,0,Rt,it.width,it.height,1,mt,ce)}}else e.compressedTexSubImage3D(i.TEXTURE_2D_ARRAY,ct,0,0,0,it.width,it.height,st.depth,mt,it.data)}else e.compressedTexImage3D(i.TEXTURE_2D_ARRAY,ct,ot,it.width,it.height,st.depth,0,it.data,0,0);else $t("WebGLRenderer: Attempt to load unsupported compressed texture format in .uploadTexture()");else _t?Wt&&e.texSubImage3D(i.TEXTURE_2D_ARRAY,ct,0,0,0,it.width,it.height,st.depth,mt,U,it.data):e.texImage3D(i.TEXTURE_2D_ARRAY,ct,ot,it.width,it.height,st.depth,0,mt,U,it.data);S.layerUpdates.size>0&&S.clearLayerUpdates()}else{_t&&bt&&e.texStorage2D(i.TEXTURE_2D,Qt,ot,Tt[0].width,Tt[0].height);for(let ct=0,kt=Tt.length;ct<kt;ct++)it=Tt[ct],S.format!==Xi?mt!==null?_t?Wt&&e.compressedTexSubImage2D(i.TEXTURE_2D,ct,0,0,it.width,it.height,mt,it.data):e.compressedTexImage2D(i.TEXTURE_2D,ct,ot,it.width,it.height,0,it.data):$t("WebGLRenderer: Attempt to load unsupported compressed texture format in .uploadTexture()"):_t?Wt&&e.texSubImage2D(i.TEXTURE_2D,ct,0,0,it.width,it.height,mt,U,it.data):e.texImage2D(i.TEXTURE_2D,ct,ot,it.width,it.height,0,mt,U,it.data)}else if(S.isDataArrayTexture)if(_t){if(bt&&e.texStorage3D(i.TEXTURE_2D_ARRAY,Qt,ot,st.width,st.height,st.depth),Wt)if(S.layerUpdates.size>0){let ct=Vd(st.width,st.height,S.format,S.type);for(let kt of S.layerUpdates){let te=st.data.subarray(kt*ct/st.data.BYTES_PER_ELEMENT,(kt+1)*ct/st.data.BYTES_PER_ELEMENT);e.texSubImage3D(i.TEXTURE_2D_ARRAY,0,0,0,kt,st.width,st.height,1,mt,U,te)}S.clearLayerUpdates()}else e.texSubImage3D(i.TEXTURE_2D_ARRAY,0,0,0,0,st.width,st.height,st.depth,mt,U,st.data)}else e.texImage3D(i.TEXTURE_2D_ARRAY,0,ot,st.width,st.height,st.depth,0,mt,U,st.data);else if(S.isData3DTexture)_t?(bt&&e.texStorage3D(i.TEXTURE_3D,Qt,ot,st.width,st.height,st.depth),Wt&&e.texSubImage3D(i.TEXTURE_3D,0,0,0,0,st.width,st.height,st.depth,mt,U,st.data)):e.texImage3D(i.TEXTURE_3D,0,ot,st.width,st.height,st.depth,0,mt,U,st.data);else if(S.isFramebufferTexture){if(bt)if(_t)e.texStorage2D(i.TEXTURE_2D,Qt,ot,st.width,st.height);else{let ct=st.width,kt=st.height;for(let te=0;te<Qt;te++)e.texImage2D(i.TEXTURE_2D,te,ot,ct,kt,0,mt,U,null),ct>>=1,kt>>=1}}else if(S.isHTMLTexture){if("texElementImage2D"in i){let ct=i.canvas;if(ct.hasAttribute("layoutsubtree")||ct.setAttribute("layoutsubtree","true"),st.parentNode!==ct){ct.appendChild(st),h.add(S),ct.onpaint=kt=>{let te=kt.changedElements;for(let Rt of h)te.includes(Rt.image)&&(Rt.needsUpdate=!0)},ct.requestPaint();return}if(i.texElementImage2D.length===3)i.texElementImage2D(i.TEXTURE_2D,i.RGBA8,st);else{let te=i.RGBA,Rt=i.RGBA,ce=i.UNSIGNED_BYTE;i.texElementImage2D(i.TEXTURE_2D,0,te,Rt,ce,st)}i.texParameteri(i.TEXTURE_2D,i.TEXTURE_MIN_FILTER,i.LINEAR),i.texParameteri(i.TEXTURE_2D,i.TEXTURE_WRAP_S,i.CLAMP_TO_EDGE),i.texParameteri(i.TEXTURE_2D,i.TEXTURE_WRAP_T,i.CLAMP_TO_EDGE)}}else if(Tt.length>0){if(_t&&bt){let ct=Yt(Tt[0]);e.texStorage2D(i.TEXTURE_2D,Qt,ot,ct.width,ct.height)}for(let ct=0,kt=Tt.length;ct<kt;ct++)it=Tt[ct],_t?Wt&&e.texSubImage2D(i.TEXTURE_2D,ct,0,0,mt,U,it):e.texImage2D(i.TEXTURE_2D,ct,ot,mt,U,it);S.generateMipmaps=!1}else if(_t){if(bt){let ct=Yt(st);e.texStorage2D(i.TEXTURE_2D,Qt,ot,ct.width,ct.height)}Wt&&e.texSubImage2D(i.TEXTURE_2D,0,0,0,mt,U,st)}else e.texImage2D(i.TEXTURE_2D,0,ot,mt,U,st);E(S)&&S.mipmapsAutoUpdate===!0&&b(ut),vt.__version=xt.version,S.onUpdate&&S.onUpdate(S)}C.__version=S.version}function an(C,S,Y){if(S.image.length!==6)return;let ut=ue(C,S),at=S.source;e.bindTexture(i.TEXTURE_CUBE_MAP,C.__webglTexture,i.TEXTURE0+Y);let xt=n.get(at);if(at.version!==xt.__version||ut===!0){e.activeTexture(i.TEXTURE0+Y);let vt=ye.getPrimaries(ye.workingColorSpace),nt=S.colorSpace===Fs?null:ye.getPrimaries(S.colorSpace),st=S.colorSpace===Fs||vt===nt?i.NONE:i.BROWSER_DEFAULT_WEBGL;e.pixelStorei(i.UNPACK_FLIP_Y_WEBGL,S.flipY),e.pixelStorei(i.UNPACK_PREMULTIPLY_ALPHA_WEBGL,S.premultiplyAlpha),e.pixelStorei(i.UNPACK_ALIGNMENT,S.unpackAlignment),e.pixelStorei(i.UNPACK_COLORSPACE_CONVERSION_WEBGL,st);let mt=S.isCompressedTexture||S.image[0].isCompressedTexture,U=S.image[0]&&S.image[0].isDataTexture,ot=[];for(let Rt=0;Rt<6;Rt++)!mt&&!U?ot[Rt]=v(S.image[Rt],!0,s.maxCubemapSize):ot[Rt]=U?S.image[Rt].image:S.image[Rt],ot[Rt]=Gt(S,ot[Rt]);let it=ot[0],Tt=r.convert(S.format,S.colorSpace),_t=r.convert(S.type),bt=A(S.internalFormat,Tt,_t,S.normalized,S.colorSpace),Wt=S.isVideoTexture!==!0,Qt=xt.__version===void 0||ut===!0,ct=at.dataReady,kt=T(S,it);pe(i.TEXTURE_CUBE_MAP,S);let te;if(S.isDepthTexture){if(bt=x(S.format===Os,S.type),Qt)if(Wt)e.texStorage2D(i.TEXTURE_CUBE_MAP,1,bt,it.width,it.height);else for(let Rt=0;Rt<6;Rt++)e.texImage2D(i.TEXTURE_CUBE_MAP_POSITIVE_X+Rt,0,bt,it.width,it.height,0,Tt,_t,null)}else if(mt){Wt&&Qt&&e.texStorage2D(i.TEXTURE_CUBE_MAP,kt,bt,it.width,it.height);for(let Rt=0;Rt<6;Rt++){te=ot[Rt].mipmaps;for(let ce=0;ce<te.length;ce++){let Ge=te[ce];S.format!==Xi?Tt!==null?Wt?ct&&e.compressedTexSubImage2D(i.TEXTURE_CUBE_MAP_POSITIVE_X+Rt,ce,0,0,Ge.width,Ge.height,Tt,Ge.data):e.compressedTexImage2D(i.TEXTURE_CUBE_MAP_POSITIVE_X+Rt,ce,bt,Ge.width,Ge.height,0,Ge.data):$t("WebGLRenderer: Attempt to load unsupported compressed texture format in .setTextureCube()"):Wt?ct&&e.texSubImage2D(i.TEXTURE_CUBE_MAP_POSITIVE_X+Rt,ce,0,0,Ge.width,Ge.height,Tt,_t,Ge.data):e.texImage2D(i.TEXTURE_CUBE_MAP_POSITIVE_X+Rt,ce,bt,Ge.width,Ge.height,0,Tt,_t,Ge.data)}}}else{if(te=S.mipmaps,Wt&&Qt){te.length>0&&kt++;let Rt=Yt(ot[0]);e.texStorage2D(i.TEXTURE_CUBE_MAP,kt,bt,Rt.width,Rt.height)}for(let Rt=0;Rt<6;Rt++)if(U){Wt?ct&&e.texSubImage2D(i.TEXTURE_CUBE_MAP_POSITIVE_X+Rt,0,0,0,ot[Rt].width,ot[Rt].height,Tt,_t,ot[Rt].data):e.texImage2D(i.TEXTURE_CUBE_MAP_POSITIVE_X+Rt,0,bt,ot[Rt].width,ot[Rt].height,0,Tt,_t,ot[Rt].data);for(let ce=0;ce<te.length;ce++){let Xn=te[ce].image[Rt].image;Wt?ct&&e.texSubImage2D(i.TEXTURE_CUBE_MAP_POSITIVE_X+Rt,ce+1,0,0,Xn.width,Xn.height,Tt,_t,Xn.data):e.texImage2D(i.TEXTURE_CUBE_MAP_POSITIVE_X+Rt,ce+1,bt,Xn.width,Xn.height,0,Tt,_t,Xn.data)}}else{Wt?ct&&e.texSubImage2D(i.TEXTURE_CUBE_MAP_POSITIVE_X+Rt,0,0,0,Tt,_t,ot[Rt]):e.texImage2D(i.TEXTURE_CUBE_MAP_POSITIVE_X+Rt,0,bt,Tt,_t,ot[Rt]);for(let ce=0;ce<te.length;ce++){let Ge=te[ce];Wt?ct&&e.texSubImage2D(i.TEXTURE_CUBE_MAP_POSITIVE_X+Rt,ce+1,0,0,Tt,_t,Ge.image[Rt]):e.texImage2D(i.TEXTURE_CUBE_MAP_POSITIVE_X+Rt,ce+1,bt,Tt,_t,Ge.image[Rt])}}}E(S)&&S.mipmapsAutoUpdate===!0&&b(i.TEXTURE_CUBE_MAP),xt.__version=at.version,S.onUpdate&&S.onUpdate(S)}C.__version=S.version}function Ue(C,S,Y,ut,at,xt){let vt=r.convert(Y.format,Y.colorSpace),nt=r.convert(Y.type),st=A(Y.internalFormat,vt,nt,Y.normalized,Y.colorSpace),mt=n.get(S),U=n.get(Y);if(U.__renderTarget=S,!mt.__hasExternalTextures){let ot=Math.max(1,S.width>>xt),it=Math.max(1,S.height>>xt);at===i.TEXTURE_3D||at===i.TEXTURE_2D_ARRAY?e.texImage3D(at,xt,st,ot,it,S.depth,0,vt,nt,null):e.texImage2D(at,xt,st,ot,it,0,vt,nt,null)}e.bindFramebuffer(i.FRAMEBUFFER,C),wt(S)?a.framebufferTexture2DMultisampleEXT(i.FRAMEBUFFER,ut,at,U.__webglTexture,0,ae(S)):(at===i.TEXTURE_2D||at>=i.TEXTURE_CUBE_MAP_POSITIVE_X&&at<=i.TEXTURE_CUBE_MAP_NEGATIVE_Z)&&i.framebufferTexture2D(i.FRAMEBUFFER,ut,at,U.__webglTexture,xt),e.bindFramebuffer(i.FRAMEBUFFER,null)}function En(C,S,Y){if(i.bindRenderbuffer(i.RENDERBUFFER,C),S.depthBuffer){let ut=S.depthTexture,at=ut&&ut.isDepthTexture?ut.type:null,xt=x(S.stencilBuffer,at),vt=S.stencilBuffer?i.DEPTH_STENCIL_ATTACHMENT:i.DEPTH_ATTACHMENT;wt(S)?a.renderbufferStorageMultisampleEXT(i.RENDERBUFFER,ae(S),xt,S.width,S.height):Y?i.renderbufferStorageMultisample(i.RENDERBUFFER,ae(S),xt,S.width,S.height):i.renderbufferStorage(i.RENDERBUFFER,xt,S.width,S.height),i.framebufferRenderbuffer(i.FRAMEBUFFER,vt,i.RENDERBUFFER,C)}else{let ut=S.textures;for(let at=0;at<ut.length;at++){let xt=ut[at],vt=r.convert(xt.format,xt.colorSpace),nt=r.convert(xt.type),st=A(xt.internalFormat,vt,nt,xt.normalized,xt.colorSpace);wt(S)?a.renderbufferStorageMultisampleEXT(i.RENDERBUFFER,ae(S),st,S.width,S.height):Y?i.renderbufferStorageMultisample(i.RENDERBUFFER,ae(S),st,S.width,S.height):i.renderbufferStorage(i.RENDERBUFFER,st,S.width,S.height)}}i.bindRenderbuffer(i.RENDERBUFFER,null)}function Se(C,S,Y){let ut=S.isWebGLCubeRenderTarget===!0;if(e.bindFramebuffer(i.FRAMEBUFFER,C),!(S.depthTexture&&S.depthTexture.isDepthTexture))throw new Error("THREE.WebGLTextures: renderTarget.depthTexture must be an instance of THREE.DepthTexture.");let at=n.get(S.depthTexture);at.__renderTarget=S;let xt=ut?S.depthTexture.image[0]:S.depthTexture.image;(!at.__webglTexture||xt.width!==S.width||xt.height!==S.height)&&(xt.width=S.width,xt.height=S.height,S.depthTexture.needsUpdate=!0),ut?Mt(S.depthTexture,0):gt(S.depthTexture,0);let vt=at.__webglTexture,nt=ae(S),st=ut?i.TEXTURE_CUBE_MAP_POSITIVE_X+Y:i.TEXTURE_2D,mt=S.depthTexture.format===Os?i.DEPTH_STENCIL_ATTACHMENT:i.DEPTH_ATTACHMENT;if(S.depthTexture.format===Is)wt(S)?a.framebufferTexture2DMultisampleEXT(i.FRAMEBUFFER,mt,st,vt,0,nt):i.framebufferTexture2D(i.FRAMEBUFFER,mt,st,vt,0);else if(S.depthTexture.format===Os)wt(S)?a.framebufferTexture2DMultisampleEXT(i.FRAMEBUFFER,mt,st,vt,0,nt):i.framebufferTexture2D(i.FRAMEBUFFER,mt,st,vt,0);else throw new Error("THREE.WebGLTextures: Unknown depthTexture format.")}function xn(C){let S=n.get(C),Y=C.isWebGLCubeRenderTarget===!0;if(S.__boundDepthTexture!==C.depthTexture){let ut=C.depthTexture;if(S.__depthDisposeCallback&&S.__depthDisposeCallback(),ut){let at=()=>{delete S.__boundDepthTexture,delete S.__depthDisposeCallback,ut.removeEventListener("dispose",at)};ut.addEventListener("dispose",at),S.__depthDisposeCallback=at}S.__boundDepthTexture=ut}if(C.depthTexture&&!S.__autoAllocateDepthBuffer)if(Y)for(let ut=0;ut<6;ut++)Se(S.__webglFramebuffer[ut],C,ut);else C.texture.mipmaps.length>0?Se(S.__webglFramebuffer[0],C,0):Se(S.__webglFramebuffer,C,0);else if(Y){S.__webglDepthbuffer=[];for(let ut=0;ut<6;ut++)if(e.bindFramebuffer(i.FRAMEBUFFER,S.__webglFramebuffer[ut]),S.__webglDepthbuffer[ut]===void 0)S.__webglDepthbuffer[ut]=i.createRenderbuffer(),En(S.__webglDepthbuffer[ut],C,!1);else{let at=C.stencilBuffer?i.DEPTH_STENCIL_ATTACHMENT:i.DEPTH_ATTACHMENT,xt=S.__webglDepthbuffer[ut];i.bindRenderbuffer(i.RENDERBUFFER,xt),i.framebufferRenderbuffer(i.FRAMEBUFFER,at,i.RENDERBUFFER,xt)}}else if(C.texture.mipmaps.length>0?e.bindFramebuffer(i.FRAMEBUFFER,S.__webglFramebuffer[0]):e.bindFramebuffer(i.FRAMEBUFFER,S.__webglFramebuffer),S.__webglDepthbuffer===void 0)S.__webglDepthbuffer=i.createRenderbuffer(),En(S.__webglDepthbuffer,C,!1);else{let at=C.stencilBuffer?i.DEPTH_STENCIL_ATTACHMENT:i.DEPTH_ATTACHMENT,xt=S.__webglDepthbuffer;i.bindRenderbuffer(i.RENDERBUFFER,xt),i.framebufferRenderbuffer(i.FRAMEBUFFER,at,i.RENDERBUFFER,xt)}e.bindFramebuffer(i.FRAMEBUFFER,null)}function je(C,S,Y){let ut=n.get(C);S!==void 0&&Ue(ut.__webglFramebuffer,C,C.texture,i.COLOR_ATTACHMENT0,i.TEXTURE_2D,0),Y!==void 0&&xn(C)}function ln(C){let S=C.texture,Y=n.get(C),ut=n.get(S);C.addEventListener("dispose",X),V(C);let at=C.textures,xt=C.isWebGLCubeRenderTarget===!0,vt=at.length>1;if(vt||(ut.__webglTexture===void 0&&(ut.__webglTexture=i.createTexture()),ut.__version=S.version,o.memory.textures++),xt){Y.__webglFramebuffer=[];for(let nt=0;nt<6;nt++)if(S.mipmaps.length>0){Y.__webglFramebuffer[nt]=[];for(let st=0;st<S.mipmaps.length;st++)Y.__webglFramebuffer[nt][st]=i.createFramebuffer()}else Y.__webglFramebuffer[nt]=i.createFramebuffer()}else{if(S.mipmaps.length>0){Y.__webglFramebuffer=[];for(let nt=0;nt<S.mipmaps.length;nt++)Y.__webglFramebuffer[nt]=i.createFramebuffer()}else Y.__webglFramebuffer=i.createFramebuffer();if(vt)for(let nt=0,st=at.length;nt<st;nt++){let mt=n.get(at[nt]);mt.__webglTexture===void 0&&(mt.__webglTexture=i.createTexture(),o.memory.textures++)}if(C.samples>0&&wt(C)===!1){Y.__webglMultisampledFramebuffer=i.createFramebuffer(),Y.__webglColorRenderbuffer=[],e.bindFramebuffer(i.FRAMEBUFFER,Y.__webglMultisampledFramebuffer);for(let nt=0;nt<at.length;nt++){let st=at[nt];Y.__webglColorRenderbuffer[nt]=i.createRenderbuffer(),i.bindRenderbuffer(i.RENDERBUFFER,Y.__webglColorRenderbuffer[nt]);let mt=r.convert(st.format,st.colorSpace),U=r.convert(st.type),ot=A(st.internalFormat,mt,U,st.normalized,st.colorSpace,C.isXRRenderTarget===!0),it=ae(C);i.renderbufferStorageMultisample(i.RENDERBUFFER,it,ot,C.width,C.height),i.framebufferRenderbuffer(i.FRAMEBUFFER,i.COLOR_ATTACHMENT0+nt,i.RENDERBUFFER,Y.__webglColorRenderbuffer[nt])}i.bindRenderbuffer(i.RENDERBUFFER,null),C.depthBuffer&&(Y.__webglDepthRenderbuffer=i.createRenderbuffer(),En(Y.__webglDepthRenderbuffer,C,!0)),e.bindFramebuffer(i.FRAMEBUFFER,null)}}if(xt){e.bindTexture(i.TEXTURE_CUBE_MAP,ut.__webglTexture),pe(i.TEXTURE_CUBE_MAP,S);for(let nt=0;nt<6;nt++)if(S.mipmaps.length>0)for(let st=0;st<S.mipmaps.length;st++)Ue(Y.__webglFramebuffer[nt][st],C,S,i.COLOR_ATTACHMENT0,i.TEXTURE_CUBE_MAP_POSITIVE_X+nt,st);else Ue(Y.__webglFramebuffer[nt],C,S,i.COLOR_ATTACHMENT0,i.TEXTURE_CUBE_MAP_POSITIVE_X+nt,0);E(S)?b(i.TEXTURE_CUBE_MAP):S.mipmaps.length>0&&i.texParameteri(i.TEXTURE_CUBE_MAP,i.TEXTURE_MAX_LEVEL,S.mipmaps.length-1),e.unbindTexture()}else if(vt){for(let nt=0,st=at.length;nt<st;nt++){let mt=at[nt],U=n.get(mt),ot=i.TEXTURE_2D;(C.isWebGL3DRenderTarget||C.isWebGLArrayRenderTarget)&&(ot=C.isWebGL3DRenderTarget?i.TEXTURE_3D:i.TEXTURE_2D_ARRAY),e.bindTexture(ot,U.__webglTexture),pe(ot,mt),Ue(Y.__webglFramebuffer,C,mt,i.COLOR_ATTACHMENT0+nt,ot,0),E(mt)&&b(ot)}e.unbindTexture()}else{let nt=i.TEXTURE_2D;if((C.isWebGL3DRenderTarget||C.isWebGLArrayRenderTarget)&&(nt=C.isWebGL3DRenderTarget?i.TEXTURE_3D:i.TEXTURE_2D_ARRAY),e.bindTexture(nt,ut.__webglTexture),pe(nt,S),S.mipmaps.length>0)for(let st=0;st<S.mipmaps.length;st++)Ue(Y.__webglFramebuffer[st],C,S,i.COLOR_ATTACHMENT0,nt,st);else Ue(Y.__webglFramebuffer,C,S,i.COLOR_ATTACHMENT0,nt,0);E(S)?b(nt):S.mipmaps.length>0&&i.texParameteri(nt,i.TEXTURE_MAX_LEVEL,S.mipmaps.length-1),e.unbindTexture()}C.depthBuffer&&xn(C)}function O(C){let S=C.textures;for(let Y=0,ut=S.length;Y<ut;Y++){let at=S[Y];if(E(at)&&at.mipmapsAutoUpdate===!0){let xt=I(C),vt=n.get(at).__webglTexture;e.bindTexture(xt,vt),b(xt),e.unbindTexture()}}}let It=[];function Kt(C){if(C.samples>0){if(wt(C)===!1){let S=C.textures,Y=C.width,ut=C.height,at=i.COLOR_BUFFER_BIT,xt=C.stencilBuffer?i.DEPTH_STENCIL_ATTACHMENT:i.DEPTH_ATTACHMENT,vt=n.get(C),nt=S.length>1;if(nt)for(let mt=0;mt<S.length;mt++)e.bindFramebuffer(i.FRAMEBUFFER,vt.__webglMultisampledFramebuffer),i.framebufferRenderbuffer(i.FRAMEBUFFER,i.COLOR_ATTACHMENT0+mt,i.RENDERBUFFER,null),e.bindFramebuffer(i.FRAMEBUFFER,vt.__webglFramebuffer),i.framebufferTexture2D(i.DRAW_FRAMEBUFFER,i.COLOR_ATTACHMENT0+mt,i.TEXTURE_2D,null,0);e.bindFramebuffer(i.READ_FRAMEBUFFER,vt.__webglMultisampledFramebuffer),C.texture.mipmaps.length>0?e.bindFramebuffer(i.DRAW_FRAMEBUFFER,vt.__webglFramebuffer[0]):e.bindFramebuffer(i.DRAW_FRAMEBUFFER,vt.__webglFramebuffer);for(let mt=0;mt<S.length;mt++){if(C.resolveDepthBuffer&&(C.depthBuffer&&(at|=i.DEPTH_BUFFER_BIT),C.stencilBuffer&&C.resolveStencilBuffer&&(at|=i.STENCIL_BUFFER_BIT)),nt){i.framebufferRenderbuffer(i.READ_FRAMEBUFFER,i.COLOR_ATTACHMENT0,i.RENDERBUFFER,vt.__webglColorRenderbuffer[mt]);let U=n.get(S[mt]).__webglTexture;i.framebufferTexture2D(i.DRAW_FRAMEBUFFER,i.COLOR_ATTACHMENT0,i.TEXTURE_2D,U,0)}i.blitFramebuffer(0,0,Y,ut,0,0,Y,ut,at,i.NEAREST),l===!0&&(It.length=0,It.push(i.COLOR_ATTACHMENT0+mt),C.depthBuffer&&C.storeMultisampledDepthBuffer===!1&&It.push(xt),i.invalidateFramebuffer(i.READ_FRAMEBUFFER,It))}if(e.bindFramebuffer(i.READ_FRAMEBUFFER,null),e.bindFramebuffer(i.DRAW_FRAMEBUFFER,null),nt)for(let mt=0;mt<S.length;mt++){e.bindFramebuffer(i.FRAMEBUFFER,vt.__webglMultisampledFramebuffer),i.framebufferRenderbuffer(i.FRAMEBUFFER,i.COLOR_ATTACHMENT0+mt,i.RENDERBUFFER,vt.__webglColorRenderbuffer[mt]);let U=n.get(S[mt]).__webglTexture;e.bindFramebuffer(i.FRAMEBUFFER,vt.__webglFramebuffer),i.framebufferTexture2D(i.DRAW_FRAMEBUFFER,i.COLOR_ATTACHMENT0+mt,i.TEXTURE_2D,U,0)}e.bindFramebuffer(i.DRAW_FRAMEBUFFER,vt.__webglMultisampledFramebuffer)}else if(C.depthBuffer&&C.storeMultisampledDepthBuffer===!1&&l){let S=C.stencilBuffer?i.DEPTH_STENCIL_ATTACHMENT:i.DEPTH_ATTACHMENT;i.invalidateFramebuffer(i.DRAW_FRAMEBUFFER,[S])}}}function ae(C){return Math.min(s.maxSamples,C.samples)}function wt(C){let S=n.get(C);return C.samples>0&&t.has("WEBGL_multisampled_render_to_texture")===!0&&S.__useRenderToTexture!==!1}function Be(C){let S=o.render.frame;u.get(C)!==S&&(u.set(C,S),C.update())}function Gt(C,S){let Y=C.colorSpace,ut=C.format,at=C.type;return C.isCompressedTexture===!0||C.isVideoTexture===!0||Y!==ba&&Y!==Fs&&(ye.getTransfer(Y)===Re?(ut!==Xi||at!==oi)&&$t("WebGLTextures: sRGB encoded textures have to use RGBAFormat and UnsignedByteType."):ee("WebGLTextures: Unsupported texture color space:",Y)),S}function Yt(C){return typeof HTMLImageElement<"u"&&C instanceof HTMLImageElement?(c.width=C.naturalWidth||C.width,c.height=C.naturalHeight||C.height):typeof VideoFrame<"u"&&C instanceof VideoFrame?(c.width=C.displayWidth,c.height=C.displayHeight):(c.width=C.width,c.height=C.height),c}this.allocateTextureUnit=dt,this.resetTextureUnits=tt,this.getTextureUnits=rt,this.setTextureUnits=ft,this.setTexture2D=gt,this.setTexture2DArray=yt,this.setTexture3D=Ct,this.setTextureCube=Mt,this.rebindTextures=je,this.setupRenderTarget=ln,this.updateRenderTargetMipmap=O,this.updateMultisampleRenderTarget=Kt,this.setupDepthRenderbuffer=xn,this.setupFrameBufferTexture=Ue,this.useMultisampledRTT=wt,this.dispose=W}function DM(i,t){function e(n,s=Fs){let r,o=ye.getTransfer(s);if(n===oi)return i.UNSIGNED_BYTE;if(n===qc)return i.UNSIGNED_SHORT_4_4_4_4;if(n===Yc)return i.UNSIGNED_SHORT_5_5_5_1;if(n===wd)return i.UNSIGNED_INT_5_9_9_9_REV;if(n===Td)return i.UNSIGNED_INT_10F_11F_11F_REV;if(n===bd)return i.BYTE;if(n===Md)return i.SHORT;if(n===zo)return i.UNSIGNED_SHORT;if(n===Xc)return i.INT;if(n===Gi)return i.UNSIGNED_INT;if(n===Hi)return i.FLOAT;if(n===Wi)return i.HALF_FLOAT;if(n===Ad)return i.ALPHA;if(n===Ed)return i.RGB;if(n===Xi)return i.RGBA;if(n===Is)return i.DEPTH_COMPONENT;if(n===Os)return i.DEPTH_STENCIL;if(n===Cd)return i.RED;if(n===$c)return i.RED_INTEGER;if(n===cr)return i.RG;if(n===Kc)return i.RG_INTEGER;if(n===Zc)return i.RGBA_INTEGER;if(n===qa||n===Ya||n===$a||n===Ka)if(o===Re)if(r=t.get("WEBGL_compressed_texture_s3tc_srgb"),r!==null){if(n===qa)return r.COMPRESSED_SRGB_S3TC_DXT1_EXT;if(n===Ya)return r.COMPRESSED_SRGB_ALPHA_S3TC_DXT1_EXT;if(n===$a)return r.COMPRESSED_SRGB_ALPHA_S3TC_DXT3_EXT;if(n===Ka)return r.COMPRESSED_SRGB_ALPHA_S3TC_DXT5_EXT}else return null;else if(r=t.get("WEBGL_compressed_texture_s3tc"),r!==null){if(n===qa)return r.COMPRESSED_RGB_S3TC_DXT1_EXT;if(n===Ya)return r.COMPRESSED_RGBA_S3TC_DXT1_EXT;if(n===$a)return r.COMPRESSED_RGBA_S3TC_DXT3_EXT;if(n===Ka)return r.COMPRESSED_RGBA_S3TC_DXT5_EXT}else return null;if(n===Jc||n===jc||n===Qc||n===th)if(r=t.get("WEBGL_compressed_texture_pvrtc"),r!==null){if(n===Jc)return r.COMPRESSED_RGB_PVRTC_4BPPV1_IMG;if(n===jc)return r.COMPRESSED_RGB_PVRTC_2BPPV1_IMG;if(n===Qc)return r.COMPRESSED_RGBA_PVRTC_4BPPV1_IMG;if(n===th)return r.COMPRESSED_RGBA_PVRTC_2BPPV1_IMG}else return null;if(n===eh||n===nh||n===ih||n===sh||n===rh||n===Za||n===oh)if(r=t.get("WEBGL_compressed_texture_etc"),r!==null){if(n===eh||n===nh)return o===Re?r.COMPRESSED_SRGB8_ETC2:r.COMPRESSED_RGB8_ETC2;if(n===ih)return o===Re?r.COMPRESSED_SRGB8_ALPHA8_ETC2_EAC:r.COMPRESSED_RGBA8_ETC2_EAC;if(n===sh)return r.COMPRESSED_R11_EAC;if(n===rh)return r.COMPRESSED_SIGNED_R11_EAC;if(n===Za)return r.COMPRESSED_RG11_EAC;if(n===oh)return r.COMPRESSED_SIGNED_RG11_EAC}else return null;if(n===ah||n===lh||n===ch||n===hh||n===uh||n===dh||n===fh||n===ph||n===mh||n===gh||n===_h||n===xh||n===yh||n===vh)if(r=t.get("WEBGL_compressed_texture_astc"),r!==null){if(n===ah)return o===Re?r.COMPRESSED_SRGB8_ALPHA8_ASTC_4x4_KHR:r.COMPRESSED_RGBA_ASTC_4x4_KHR;if(n===lh)return o===Re?r.COMPRESSED_SRGB8_ALPHA8_ASTC_5x4_KHR:r.COMPRESSED_RGBA_ASTC_5x4_KHR;if(n===ch)return o===Re?r.COMPRESSED_SRGB8_ALPHA8_ASTC_5x5_KHR:r.COMPRESSED_RGBA_ASTC_5x5_KHR;if(n===hh)return o===Re?r.COMPRESSED_SRGB8_ALPHA8_ASTC_6x5_KHR:r.COMPRESSED_RGBA_ASTC_6x5_KHR;if(n===uh)return o===Re?r.COMPRESSED_SRGB8_ALPHA8_ASTC_6x6_KHR:r.COMPRESSED_RGBA_ASTC_6x6_KHR;if(n===dh)return o===Re?r.COMPRESSED_SRGB8_ALPHA8_ASTC_8x5_KHR:r.COMPRESSED_RGBA_ASTC_8x5_KHR;if(n===fh)return o===Re?r.COMPRESSED_SRGB8_ALPHA8_ASTC_8x6_KHR:r.COMPRESSED_RGBA_ASTC_8x6_KHR;if(n===ph)return o===Re?r.COMPRESSED_SRGB8_ALPHA8_ASTC_8x8_KHR:r.COMPRESSED_RGBA_ASTC_8x8_KHR;if(n===mh)return o===Re?r.COMPRESSED_SRGB8_ALPHA8_ASTC_10x5_KHR:r.COMPRESSED_RGBA_ASTC_10x5_KHR;if(n===gh)return o===Re?r.COMPRESSED_SRGB8_ALPHA8_ASTC_10x6_KHR:r.COMPRESSED_RGBA_ASTC_10x6_KHR;if(n===_h)return o===Re?r.COMPRESSED_SRGB8_ALPHA8_ASTC_10x8_KHR:r.COMPRESSED_RGBA_ASTC_10x8_KHR;if(n===xh)return o===Re?r.COMPRESSED_SRGB8_ALPHA8_ASTC_10x10_KHR:r.COMPRESSED_RGBA_ASTC_10x10_KHR;if(n===yh)return o===Re?r.COMPRESSED_SRGB8_ALPHA8_ASTC_12x10_KHR:r.COMPRESSED_RGBA_ASTC_12x10_KHR;if(n===vh)return o===Re?r.COMPRESSED_SRGB8_ALPHA8_ASTC_12x12_KHR:r.COMPRESSED_RGBA_ASTC_12x12_KHR}else return null;if(n===Sh||n===bh||n===Mh)if(r=t.get("EXT_texture_compression_bptc"),r!==null){if(n===Sh)return o===Re?r.COMPRESSED_SRGB_ALPHA_BPTC_UNORM_EXT:r.COMPRESSED_RGBA_BPTC_UNORM_EXT;if(n===bh)return r.COMPRESSED_RGB_BPTC_SIGNED_FLOAT_EXT;if(n===Mh)return r.COMPRESSED_RGB_BPTC_UNSIGNED_FLOAT_EXT}else return null;if(n===wh||n===Th||n===Ja||n===Ah)if(r=t.get("EXT_texture_compression_rgtc"),r!==null){if(n===wh)return r.COMPRESSED_RED_RGTC1_EXT;if(n===Th)return r.COMPRESSED_SIGNED_RED_RGTC1_EXT;if(n===Ja)return r.COMPRESSED_RED_GREEN_RGTC2_EXT;if(n===Ah)return r.COMPRESSED_SIGNED_RED_GREEN_RGTC2_EXT}else return null;return n===Rr?i.UNSIGNED_INT_24_8:i[n]!==void 0?i[n]:null}return{convert:e}}var NM=`
void main() {

	gl_Position = vec4( position, 1.0 );

}`,UM=`
uniform sampler2DArray depthColor;
uniform float depthWidth;
uniform float depthHeight;

void main() {

	vec2 coord = vec2( gl_FragCoord.x / depthWidth, gl_FragCoord.y / depthHeight );

	if ( coord.x >= 1.0 ) {

		gl_FragDepth = texture( depthColor, vec3( coord.x - 1.0, coord.y, 1 ) ).r;

	} else {

		gl_FragDepth = texture( depthColor, vec3( coord.x, coord.y, 0 ) ).r;

	}

}`,Zd=class{constructor(){this.texture=null,this.mesh=null,this.depthNear=0,this.depthFar=0}init(t,e){if(this.texture===null){let n=new La(t.texture);(t.depthNear!==e.depthNear||t.depthFar!==e.depthFar)&&(this.depthNear=t.depthNear,this.depthFar=t.depthFar),this.texture=n}}getMesh(t){if(this.texture!==null&&this.mesh===null){let e=t.cameras[0].viewport,n=new Ri({vertexShader:NM,fragmentShader:UM,uniforms:{depthColor:{value:this.texture},depthWidth:{value:e.z},depthHeight:{value:e.w}}});this.mesh=new Sn(new Tr(20,20),n)}return this.mesh}reset(){this.texture=null,this.mesh=null}getDepthTexture(){return this.texture}},Jd=class extends zi{constructor(t,e){super();let n=this,s=null,r=1,o=null,a="local-floor",l=1,c=null,u=null,h=null,d=null,f=null,m=null,y=typeof XRWebGLBinding<"u",p=new Zd,g={},v=e.getContextAttributes(),E=null,b=null,I=[],A=[],x=new Zt,T=null,V=null,N=new Qn;N.viewport=new Ie;let L=new Qn;L.viewport=new Ie;let X=[N,L],q=new zc,D=null,W=null;this.cameraAutoUpdate=!0,this.enabled=!1,this.isPresenting=!1,this.getController=function(et){let gt=I[et];return gt===void 0&&(gt=new Co,I[et]=gt),gt.getTargetRaySpace()},this.getControllerGrip=function(et){let gt=I[et];return gt===void 0&&(gt=new Co,I[et]=gt),gt.getGripSpace()},this.getHand=function(et){let gt=I[et];return gt===void 0&&(gt=new Co,I[et]=gt),gt.getHandSpace()};function J(et){let gt=A.indexOf(et.inputSource);if(gt===-1)return;let yt=I[gt];yt!==void 0&&(yt.update(et.inputSource,et.frame,c||o),yt.dispatchEvent({type:et.type,data:et.inputSource}))}function H(){s.removeEventListener("select",J),s.removeEventListener("selectstart",J),s.removeEventListener("selectend",J),s.removeEventListener("squeeze",J),s.removeEventListener("squeezestart",J),s.removeEventListener("squeezeend",J),s.removeEventListener("end",H),s.removeEventListener("inputsourceschange",ht);for(let et=0;et<I.length;et++){let gt=A[et];gt!==null&&(A[et]=null,I[et].disconnect(gt))}D=null,W=null,p.reset();for(let et in g)delete g[et];if(t.setRenderTarget(E),f=null,d=null,h=null,s=null,b=null,dt.stop(),n.isPresenting=!1,t.setPixelRatio(T),t.setSize(x.width,x.height,!1),V!==null){let et=V.camera;et.fov=V.fov,et.zoom=V.zoom,et.updateProjectionMatrix(),V=null}n.dispatchEvent({type:"sessionend"})}this.setFramebufferScaleFactor=function(et){r=et,n.isPresenting===!0&&$t("WebXRManager: Cannot change framebuffer scale while presenting.")},this.setReferenceSpaceType=function(et){a=et,n.isPresenting===!0&&$t("WebXRManager: Cannot change reference space type while presenting.")},this.getReferenceSpace=function(){return c||o},this.setReferenceSpace=function(et){c=et},this.getBaseLayer=function(){return d!==null?d:f},this.getBinding=function(){return h===null&&y&&(h=new XRWebGLBinding(s,e)),h},this.getFrame=function(){return m},this.getSession=function(){return s},this.setSession=async function(et){if(s=et,s!==null){if(E=t.getRenderTarget(),s.addEventListener("select",J),s.addEventListener("selectstart",J),s.addEventListener("selectend",J),s.addEventListener("squeeze",J),s.addEventListener("squeezestart",J),s.addEventListener("squeezeend",J),s.addEventListener("end",H),s.addEventListener("inputsourceschange",ht),v.xrCompatible!==!0&&await e.makeXRCompatible(),T=t.getPixelRatio(),t.getSize(x),y&&"createProjectionLayer"in XRWebGLBinding.prototype){let yt=null,Ct=null,Mt=null;v.depth&&(Mt=v.stencil?e.DEPTH24_STENCIL8:e.DEPTH_COMPONENT24,yt=v.stencil?Os:Is,Ct=v.stencil?Rr:Gi);let Xt={colorFormat:e.RGBA8,depthFormat:Mt,scaleFactor:r};h=this.getBinding(),d=h.createProjectionLayer(Xt),s.updateRenderState({layers:[d]}),t.setPixelRatio(1),t.setSize(d.textureWidth,d.textureHeight,!1),b=new xi(d.textureWidth,d.textureHeight,{format:Xi,type:oi,depthTexture:new Ds(d.textureWidth,d.textureHeight,Ct,void 0,void 0,void 0,void 0,void 0,void 0,yt),stencilBuffer:v.stencil,colorSpace:t.outputColorSpace,samples:v.antialias?4:0,resolveDepthBuffer:d.ignoreDepthValues===!1,resolveStencilBuffer:d.ignoreDepthValues===!1,storeMultisampledDepthBuffer:d.ignoreDepthValues===!1,storeMultisampledStencilBuffer:d.ignoreDepthValues===!1})}else{let yt={antialias:v.antialias,alpha:!0,depth:v.depth,stencil:v.stencil,framebufferScaleFactor:r};f=new XRWebGLLayer(s,e,yt),s.updateRenderState({baseLayer:f}),t.setPixelRatio(1),t.setSize(f.framebufferWidth,f.framebufferHeight,!1),b=new xi(f.framebufferWidth,f.framebufferHeight,{format:Xi,type:oi,colorSpace:t.outputColorSpace,stencilBuffer:v.stencil,resolveDepthBuffer:f.ignoreDepthValues===!1,resolveStencilBuffer:f.ignoreDepthValues===!1,storeMultisampledDepthBuffer:f.ignoreDepthValues===!1,storeMultisampledStencilBuffer:f.ignoreDepthValues===!1})}b.isXRRenderTarget=!0,this.setFoveation(l),c=null,o=await s.requestReferenceSpace(a),dt.setContext(s),dt.start(),n.isPresenting=!0,n.dispatchEvent({type:"sessionstart"})}},this.getEnvironmentBlendMode=function(){if(s!==null)return s.environmentBlendMode},this.getDepthTexture=function(){return p.getDepthTexture()};function ht(et){for(let gt=0;gt<et.removed.length;gt++){let yt=et.removed[gt],Ct=A.indexOf(yt);Ct>=0&&(A[Ct]=null,I[Ct].disconnect(yt))}for(let gt=0;gt<et.added.length;gt++){let yt=et.added[gt],Ct=A.indexOf(yt);if(Ct===-1){for(let Xt=0;Xt<I.length;Xt++)if(Xt>=A.length){A.push(yt),Ct=Xt;break}else if(A[Xt]===null){A[Xt]=yt,Ct=Xt;break}if(Ct===-1)break}let Mt=I[Ct];Mt&&Mt.connect(yt)}}function j(et,gt){gt===null?et.matrixWorld.copy(et.matrix):et.matrixWorld.multiplyMatrices(gt.matrixWorld,et.matrix),et.matrixWorldInverse.copy(et.matrixWorld).invert()}this.updateCamera=function(et){if(s===null)return;let gt=et.near,yt=et.far;p.texture!==null&&(p.depthNear>0&&(gt=p.depthNear),p.depthFar>0&&(yt=p.depthFar)),q.near=L.near=N.near=gt,q.far=L.far=N.far=yt,(D!==q.near||W!==q.far)&&(s.updateRenderState({depthNear:q.near,depthFar:q.far}),D=q.near,W=q.far),q.layers.mask=et.layers.mask|6,N.layers.mask=q.layers.mask&-5,L.layers.mask=q.layers.mask&-3;let Ct=et.parent,Mt=q.cameras;j(q,Ct);for(let Xt=0;Xt<Mt.length;Xt++)j(Mt[Xt],Ct);q.projectionMatrix.copy(N.projectionMatrix),q.projectionMatrixInverse.copy(N.projectionMatrixInverse),V===null&&et.isPerspectiveCamera&&(V={camera:et,fov:et.fov,zoom:et.zoom}),tt(et,q,Ct)};function tt(et,gt,yt){yt===null?et.matrix.copy(gt.matrixWorld):(et.matrix.copy(yt.matrixWorld),et.matrix.invert(),et.matrix.multiply(gt.matrixWorld)),et.matrix.decompose(et.position,et.quaternion,et.scale),et.updateMatrixWorld(!0),et.projectionMatrix.copy(gt.projectionMatrix),et.projectionMatrixInverse.copy(gt.projectionMatrixInverse),et.isPerspectiveCamera&&(et.fov=To*2*Math.atan(1/et.projectionMatrix.elements[5]),et.zoom=1)}this.getCamera=function(){return q},this.getFoveation=function(){if(!(d===null&&f===null))return l},this.setFoveation=function(et){l=et,d!==null&&(d.fixedFoveation=et),f!==null&&f.fixedFoveation!==void 0&&(f.fixedFoveation=et)},this.hasDepthSensing=function(){return p.texture!==null},this.getDepthSensingMesh=function(){return p.getMesh(q)},this.getCameraTexture=function(et){return g[et]};let rt=null;function ft(et,gt){if(u=gt.getViewerPose(c||o),m=gt,u!==null){let yt=u.views;f!==null&&(t.setRenderTargetFramebuffer(b,f.framebuffer),t.setRenderTarget(b));let Ct=!1;yt.length!==q.cameras.length&&(q.cameras.length=0,Ct=!0);for(let Ht=0;Ht<yt.length;Ht++){let pe=yt[Ht],ue=null;if(f!==null)ue=f.getViewport(pe);else{let $e=h.getViewSubImage(d,pe);ue=$e.viewport,Ht===0&&(t.setRenderTargetTextures(b,$e.colorTexture,$e.depthStencilTexture),t.setRenderTarget(b))}let se=X[Ht];se===void 0&&(se=new Qn,se.layers.enable(Ht),se.viewport=new Ie,X[Ht]=se),se.matrix.fromArray(pe.transform.matrix),se.matrix.decompose(se.position,se.quaternion,se.scale),se.projectionMatrix.fromArray(pe.projectionMatrix),se.projectionMatrixInverse.copy(se.projectionMatrix).invert(),se.viewport.set(ue.x,ue.y,ue.width,ue.height),Ht===0&&(q.matrix.copy(se.matrix),q.matrix.decompose(q.position,q.quaternion,q.scale)),Ct===!0&&q.cameras.push(se)}let Mt=s.enabledFeatures;if(Mt&&Mt.includes("depth-sensing")&&s.depthUsage=="gpu-optimized"&&y){h=n.getBinding();let Ht=h.getDepthInformation(yt[0]);Ht&&Ht.isValid&&Ht.texture&&p.init(Ht,s.renderState)}if(Mt&&Mt.includes("camera-access")&&y){t.state.unbindTexture(),h=n.getBinding();for(let Ht=0;Ht<yt.length;Ht++){let pe=yt[Ht].camera;if(pe){let ue=g[pe];ue||(ue=new La,g[pe]=ue);let se=h.getCameraImage(pe);ue.sourceTexture=se}}}}for(let yt=0;yt<I.length;yt++){let Ct=A[yt],Mt=I[yt];Ct!==null&&Mt!==void 0&&Mt.update(Ct,gt,c||o)}rt&&rt(et,gt),gt.detectedPlanes&&n.dispatchEvent({type:"planesdetected",data:gt}),m=null}let dt=new fg;dt.setAnimationLoop(ft),this.setAnimationLoop=function(et){rt=et},this.dispose=function(){}}},OM=new be,Mg=new ie;Mg.set(-1,0,0,0,1,0,0,0,1);function FM(i,t){function e(p,g){p.matrixAutoUpdate===!0&&p.updateMatrix(),g.value.copy(p.matrix)}function n(p,g){g.color.getRGB(p.fogColor.value,Bd(i)),g.isFog?(p.fogNear.value=g.near,p.fogFar.value=g.far):g.isFogExp2&&(p.fogDensity.value=g.density)}function s(p,g,v,E,b){g.isNodeMaterial?g.uniformsNeedUpdate=!1:g.isMeshBasicMaterial?r(p,g):g.isMeshLambertMaterial?(r(p,g),g.envMap&&(p.envMapIntensity.value=g.envMapIntensity)):g.isMeshToonMaterial?(r(p,g),h(p,g)):g.isMeshPhongMaterial?(r(p,g),u(p,g),g.envMap&&(p.envMapIntensity.value=g.envMapIntensity)):g.isMeshStandardMaterial?(r(p,g),d(p,g),g.isMeshPhysicalMaterial&&f(p,g,b)):g.isMeshMatcapMaterial?(r(p,g),m(p,g)):g.isMeshDepthMaterial?r(p,g):g.isMeshDistanceMaterial?(r(p,g),y(p,g)):g.isMeshNormalMaterial?r(p,g):g.isLineBasicMaterial?(o(p,g),g.isLineDashedMaterial&&a(p,g)):g.isPointsMaterial?l(p,g,v,E):g.isSpriteMaterial?c(p,g):g.isShadowMaterial?(p.color.value.copy(g.color),p.opacity.value=g.opacity):g.isShaderMaterial&&(g.uniformsNeedUpdate=!1)}function r(p,g){p.opacity.value=g.opacity,g.color&&p.diffuse.value.copy(g.color),g.emissive&&p.emissive.value.copy(g.emissive).multiplyScalar(g.emissiveIntensity),g.map&&(p.map.value=g.map,e(g.map,p.mapTransform)),g.alphaMap&&(p.alphaMap.value=g.alphaMap,e(g.alphaMap,p.alphaMapTransform)),g.bumpMap&&(p.bumpMap.value=g.bumpMap,e(g.bumpMap,p.bumpMapTransform),p.bumpScale.value=g.bumpScale,g.side===ni&&(p.bumpScale.value*=-1)),g.normalMap&&(p.normalMap.value=g.normalMap,e(g.normalMap,p.normalMapTransform),p.normalScale.value.copy(g.normalScale),g.side===ni&&p.normalScale.value.negate()),g.displacementMap&&(p.displacementMap.value=g.displacementMap,e(g.displacementMap,p.displacementMapTransform),p.displacementScale.value=g.displacementScale,p.displacementBias.value=g.displacementBias),g.emissiveMap&&(p.emissiveMap.value=g.emissiveMap,e(g.emissiveMap,p.emissiveMapTransform)),g.specularMap&&(p.specularMap.value=g.specularMap,e(g.specularMap,p.specularMapTransform)),g.alphaTest>0&&(p.alphaTest.value=g.alphaTest);let v=t.get(g),E=v.envMap,b=v.envMapRotation;E&&(p.envMap.value=E,p.envMapRotation.value.setFromMatrix4(OM.makeRotationFromEuler(b)).transpose(),E.isCubeTexture&&E.isRenderTargetTexture===!1&&p.envMapRotation.value.premultiply(Mg),p.reflectivity.value=g.reflectivity,p.ior.value=g.ior,p.refractionRatio.value=g.refractionRatio),g.lightMap&&(p.lightMap.value=g.lightMap,p.lightMapIntensity.value=g.lightMapIntensity,e(g.lightMap,p.lightMapTransform)),g.aoMap&&(p.aoMap.value=g.aoMap,p.aoMapIntensity.value=g.aoMapIntensity,e(g.aoMap,p.aoMapTransform))}function o(p,g){p.diffuse.value.copy(g.color),p.opacity.value=g.opacity,g.map&&(p.map.value=g.map,e(g.map,p.mapTransform))}function a(p,g){p.dashSize.value=g.dashSize,p.totalSize.value=g.dashSize+g.gapSize,p.scale.value=g.scale}function l(p,g,v,E){p.diffuse.value.copy(g.color),p.opacity.value=g.opacity,p.size.value=g.size*v,p.scale.value=E*.5,g.map&&(p.map.value=g.map,e(g.map,p.uvTransform)),g.alphaMap&&(p.alphaMap.value=g.alphaMap,e(g.alphaMap,p.alphaMapTransform)),g.alphaTest>0&&(p.alphaTest.value=g.alphaTest)}function c(p,g){p.diffuse.value.copy(g.color),p.opacity.value=g.opacity,p.rotation.value=g.rotation,g.map&&(p.map.value=g.map,e(g.map,p.mapTransform)),g.alphaMap&&(p.alphaMap.value=g.alphaMap,e(g.alphaMap,p.alphaMapTransform)),g.alphaTest>0&&(p.alphaTest.value=g.alphaTest)}function u(p,g){p.specular.value.copy(g.specular),p.shininess.value=Math.max(g.shininess,1e-4)}function h(p,g){g.gradientMap&&(p.gradientMap.value=g.gradientMap)}function d(p,g){p.metalness.value=g.metalness,g.metalnessMap&&(p.metalnessMap.value=g.metalnessMap,e(g.metalnessMap,p.metalnessMapTransform)),p.roughness.value=g.roughness,g.roughnessMap&&(p.roughnessMap.value=g.roughnessMap,e(g.roughnessMap,p.roughnessMapTransform)),g.envMap&&(p.envMapIntensity.value=g.envMapIntensity)}function f(p,g,v){p.ior.value=g.ior,g.diffuseRoughness>0&&(p.diffuseRoughness.value=g.diffuseRoughness,g.diffuseRoughnessMap&&(p.diffuseRoughnessMap.value=g.diffuseRoughnessMap,e(g.diffuseRoughnessMap,p.diffuseRoughnessMapTransform))),g.sheen>0&&(p.sheenColor.value.copy(g.sheenColor).multiplyScalar(g.sheen),p.sheenRoughness.value=g.sheenRoughness,g.sheenColorMap&&(p.sheenColorMap.value=g.sheenColorMap,e(g.sheenColorMap,p.sheenColorMapTransform)),g.sheenRoughnessMap&&(p.sheenRoughnessMap.value=g.sheenRoughnessMap,e(g.sheenRoughnessMap,p.sheenRoughnessMapTransform))),g.clearcoat>0&&(p.clearcoat.value=g.clearcoat,p.clearcoatRoughness.value=g.clearcoatRoughness,g.clearcoatMap&&(p.clearcoatMap.value=g.clearcoatMap,e(g.clearcoatMap,p.clearcoatMapTransform)),g.clearcoatRoughnessMap&&(p.clearcoatRoughnessMap.value=g.clearcoatRoughnessMap,e(g.clearcoatRoughnessMap,p.clearcoatRoughnessMapTransform)),g.clearcoatNormalMap&&(p.clearcoatNormalMap.value=g.clearcoatNormalMap,e(g.clearcoatNormalMap,p.clearcoatNormalMapTransform),p.clearcoatNormalScale.value.copy(g.clearcoatNormalScale),g.side===ni&&p.clearcoatNormalScale.value.negate())),g.dispersion>0&&(p.dispersion.value=g.dispersion),g.retroreflectivity>0&&(p.retroreflectivity.value=g.retroreflectivity),g.iridescence>0&&(p.iridescence.value=g.iridescence,p.iridescenceIOR.value=g.iridescenceIOR,p.iridescenceThicknessMinimum.value=g.iridescenceThicknessMinimum,p.iridescenceThicknessMaximum.value=g.iridescenceThicknessMaximum,g.iridescenceMap&&(p.iridescenceMap.value=g.iridescenceMap,e(g.iridescenceMap,p.iridescenceMapTransform)),g.iridescenceThicknessMap&&(p.iridescenceThicknessMap.value=g.iridescenceThicknessMap,e(g.iridescenceThicknessMap,p.iridescenceThicknessMapTransform))),g.transmission>0&&(p.transmission.value=g.transmission,p.transmissionSamplerMap.value=v.texture,p.transmissionSamplerSize.value.set(v.width,v.height),g.transmissionMap&&(p.transmissionMap.value=g.transmissionMap,e(g.transmissionMap,p.transmissionMapTransform)),p.thickness.value=g.thickness,g.thicknessMap&&(p.thicknessMap.value=g.thicknessMap,e(g.thicknessMap,p.thicknessMapTransform)),p.attenuationDistance.value=g.attenuationDistance,p.attenuationColor.value.copy(g.attenuationColor)),g.anisotropy>0&&(p.anisotropyVector.value.set(g.anisotropy*Math.cos(g.anisotropyRotation),g.anisotropy*Math.sin(g.anisotropyRotation)),g.anisotropyMap&&(p.anisotropyMap.value=g.anisotropyMap,e(g.anisotropyMap,p.anisotropyMapTransform))),p.specularIntensity.value=g.specularIntensity,p.specularColor.value.copy(g.specularColor),g.specularColorMap&&(p.specularColorMap.value=g.specularColorMap,e(g.specularColorMap,p.specularColorMapTransform)),g.specularIntensityMap&&(p.specularIntensityMap.value=g.specularIntensityMap,e(g.specularIntensityMap,p.specularIntensityMapTransform))}function m(p,g){g.matcap&&(p.matcap.value=g.matcap)}function y(p,g){let v=t.get(g).light;p.referencePosition.value.setFromMatrixPosition(v.matrixWorld),p.nearDistance.value=v.shadow.camera.near,p.farDistance.value=v.shadow.camera.far}return{refreshFogUniforms:n,refreshMaterialUniforms:s}}function BM(i,t,e,n){let s={},r={};function o(v,E){let b=E.program;n.uniformBlockBinding(v,b,s[v.id])}function a(v,E){let b=s[v.id];b===void 0&&(m(v),b=l(v),s[v.id]=b,v.addEventListener("dispose",p));let I=E.program;n.updateUBOMapping(v,I);let A=t.render.frame;r[v.id]!==A&&(c(v),r[v.id]=A)}function l(v){let E=i.createBuffer(),b=v.__size,I=v.usage;return i.bindBuffer(i.UNIFORM_BUFFER,E),i.bufferData(i.UNIFORM_BUFFER,b,I),i.bindBuffer(i.UNIFORM_BUFFER,null),E}function c(v){let E=s[v.id],b=v.uniforms,I=v.__cache;i.bindBuffer(i.UNIFORM_BUFFER,E);for(let A=0,x=b.length;A<x;A++){let T=b[A];if(Array.isArray(T))for(let V=0,N=T.length;V<N;V++)u(T[V],A,V,I);else u(T,A,0,I)}i.bindBuffer(i.UNIFORM_BUFFER,null)}function u(v,E,b,I){if(d(v,E,b,I)===!0){let A=v.__offset,x=v.value;if(Array.isArray(x)){let T=0;for(let V=0;V<x.length;V++){let N=x[V],L=y(N,!0);h(N,v.__data,T),T+=L.storage/Float32Array.BYTES_PER_ELEMENT}}else h(x,v.__data,0);i.bufferSubData(i.UNIFORM_BUFFER,A,v.__data)}}function h(v,E,b){typeof v=="number"||typeof v=="boolean"?E[b]=v:v.isMatrix3?(E[b]=v.elements[0],E[b+1]=v.elements[1],E[b+2]=v.elements[2],E[b+3]=0,E[b+4]=v.elements[3],E[b+5]=v.elements[4],E[b+6]=v.elements[5],E[b+7]=0,E[b+8]=v.elements[6],E[b+9]=v.elements[7],E[b+10]=v.elements[8],E[b+11]=0):ArrayBuffer.isView(v)?E.set(v.subarray(0,E.length-b),b):v.toArray(E,b)}function d(v,E,b,I){let A=v.value,x=E+"_"+b;if(Array.isArray(A)){I[x]===void 0&&(I[x]=[]);let T=I[x],V=!1;for(let N=0;N<A.length;N++)f(A[N],T,N)===!0&&(V=!0);return V}return f(A,I,x)}function f(v,E,b){if(E[b]===void 0)return typeof v=="number"||typeof v=="boolean"?E[b]=v:ArrayBuffer.isView(v)?E[b]=v.slice():E[b]=v.clone(),!0;{let I=E[b];if(typeof v=="number"||typeof v=="boolean"){if(I!==v)return E[b]=v,!0}else{if(ArrayBuffer.isView(v))return!0;if(I.equals(v)===!1)return I.copy(v),!0}}return!1}function m(v){let E=v.uniforms,b=0,I=16;for(let x=0,T=E.length;x<T;x++){let V=Array.isArray(E[x])?E[x]:[E[x]];for(let N=0,L=V.length;N<L;N++){let X=V[N],q=Array.isArray(X.value)?X.value:[X.value],D=Array.isArray(E[x])||Array.isArray(X.value),W=b;for(let H=0,ht=q.length;H<ht;H++){let j=q[H],tt=y(j,D),rt=b%I,ft=rt%tt.boundary,dt=rt+ft;b+=ft,dt!==0&&I-dt<tt.storage&&(b+=I-dt),H===0&&(W=b),b+=tt.storage}let J=X.type==="int"?Int32Array:X.type==="uint"?Uint32Array:Float32Array;X.__data=new J((b-W)/Float32Array.BYTES_PER_ELEMENT),X.__offset=W}}let A=b%I;return A>0&&(b+=I-A),v.__size=b,v.__cache={},this}function y(v,E){let b={boundary:0,storage:0};return typeof v=="number"||typeof v=="boolean"?(b.boundary=4,b.storage=4):v.isVector2?(b.boundary=8,b.storage=8):v.isVector3||v.isColor?(b.boundary=16,b.storage=12):v.isVector4?(b.boundary=16,b.storage=16):v.isMatrix3?(b.boundary=16,b.storage=48):v.isMatrix4?(b.boundary=16,b.storage=64):v.isTexture?$t("WebGLRenderer: Texture samplers can not be part of an uniforms group."):ArrayBuffer.isView(v)?(b.boundary=16,b.storage=v.byteLength):$t("WebGLRenderer: Unsupported uniform value type.",v),E===!0&&(b.boundary=16,b.storage=Math.ceil(b.storage/16)*16),b}function p(v){let E=v.target;E.removeEventListener("dispose",p),i.deleteBuffer(s[E.id]),delete s[E.id],delete r[E.id]}function g(){for(let v in s)i.deleteBuffer(s[v]);s={},r={}}return{bind:o,update:a,dispose:g}}var kM=new Uint16Array([12469,15057,12620,14925,13266,14620,13807,14376,14323,13990,14545,13625,14713,13328,14840,12882,14931,12528,14996,12233,15039,11829,15066,11525,15080,11295,15085,10976,15082,10705,15073,10495,13880,14564,13898,14542,13977,14430,14158,14124,14393,13732,14556,13410,14702,12996,14814,12596,14891,12291,14937,11834,14957,11489,14958,11194,14943,10803,14921,10506,14893,10278,14858,9960,14484,14039,14487,14025,14499,13941,14524,13740,14574,13468,14654,13106,14743,12678,14818,12344,14867,11893,14889,11509,14893,11180,14881,10751,14852,10428,14812,10128,14765,9754,14712,9466,14764,13480,14764,13475,14766,13440,14766,13347,14769,13070,14786,12713,14816,12387,14844,11957,14860,11549,14868,11215,14855,10751,14825,10403,14782,10044,14729,9651,14666,9352,14599,9029,14967,12835,14966,12831,14963,12804,14954,12723,14936,12564,14917,12347,14900,11958,14886,11569,14878,11247,14859,10765,14828,10401,14784,10011,14727,9600,14660,9289,14586,8893,14508,8533,15111,12234,15110,12234,15104,12216,15092,12156,15067,12010,15028,11776,14981,11500,14942,11205,14902,10752,14861,10393,14812,9991,14752,9570,14682,9252,14603,8808,14519,8445,14431,8145,15209,11449,15208,11451,15202,11451,15190,11438,15163,11384,15117,11274,15055,10979,14994,10648,14932,10343,14871,9936,14803,9532,14729,9218,14645,8742,14556,8381,14461,8020,14365,7603,15273,10603,15272,10607,15267,10619,15256,10631,15231,10614,15182,10535,15118,10389,15042,10167,14963,9787,14883,9447,14800,9115,14710,8665,14615,8318,14514,7911,14411,7507,14279,7198,15314,9675,15313,9683,15309,9712,15298,9759,15277,9797,15229,9773,15166,9668,15084,9487,14995,9274,14898,8910,14800,8539,14697,8234,14590,7790,14479,7409,14367,7067,14178,6621,15337,8619,15337,8631,15333,8677,15325,8769,15305,8871,15264,8940,15202,8909,15119,8775,15022,8565,14916,8328,14804,8009,14688,7614,14569,7287,14448,6888,14321,6483,14088,6171,15350,7402,15350,7419,15347,7480,15340,7613,15322,7804,15287,7973,15229,8057,15148,8012,15046,7846,14933,7611,14810,7357,14682,7069,14552,6656,14421,6316,14251,5948,14007,5528,15356,5942,15356,5977,15353,6119,15348,6294,15332,6551,15302,6824,15249,7044,15171,7122,15070,7050,14949,6861,14818,6611,14679,6349,14538,6067,14398,5651,14189,5311,13935,4958,15359,4123,15359,4153,15356,4296,15353,4646,15338,5160,15311,5508,15263,5829,15188,6042,15088,6094,14966,6001,14826,5796,14678,5543,14527,5287,14377,4985,14133,4586,13869,4257,15360,1563,15360,1642,15358,2076,15354,2636,15341,3350,15317,4019,15273,4429,15203,4732,15105,4911,14981,4932,14836,4818,14679,4621,14517,4386,14359,4156,14083,3795,13808,3437,15360,122,15360,137,15358,285,15355,636,15344,1274,15322,2177,15281,2765,15215,3223,15120,3451,14995,3569,14846,3567,14681,3466,14511,3305,14344,3121,14037,2800,13753,2467,15360,0,15360,1,15359,21,15355,89,15346,253,15325,479,15287,796,15225,1148,15133,1492,15008,1749,14856,1882,14685,1886,14506,1783,14324,1608,13996,1398,13702,1183]),ds=null;function zM(){return ds===null&&(ds=new bc(kM,16,16,cr,Wi),ds.name="DFG_LUT",ds.minFilter=ti,ds.magFilter=ti,ds.wrapS=ls,ds.wrapT=ls,ds.generateMipmaps=!1,ds.needsUpdate=!0),ds}var Lh=class{constructor(t={}){let{canvas:e=km(),context:n=null,depth:s=!0,stencil:r=!1,alpha:o=!1,antialias:a=!1,premultipliedAlpha:l=!0,preserveDrawingBuffer:c=!1,powerPreference:u="default",failIfMajorPerformanceCaveat:h=!1,reversedDepthBuffer:d=!1,outputBufferType:f=oi}=t;this.isWebGLRenderer=!0;let m;if(n!==null){if(typeof WebGLRenderingContext<"u"&&n instanceof WebGLRenderingContext)throw new Error("THREE.WebGLRenderer: WebGL 1 is not supported since r163.");m=n.getContextAttributes().alpha}else m=o;let y=f,p=new Set([Zc,Kc,$c]),g=new Set([oi,Gi,zo,Rr,qc,Yc]),v=new Uint32Array(4),E=new Int32Array(4),b={textures:[],min:[],max:[],resolution:[]},I=null,A=null,x=[],T=[],V=null;this.domElement=e,this.debug={checkShaderErrors:!0,diagnostics:{keywords:!1},onShaderError:null},this.autoClear=!0,this.autoClearColor=!0,this.autoClearDepth=!0,this.autoClearStencil=!0,this.sortObjects=!0,this.clippingPlanes=[],this.localClippingEnabled=!1,this.toneMapping=us,this.toneMappingExposure=1,this.transmissionResolutionScale=1;let N=this,L=!1,X=null,q=null,D=null,W=null;this._outputColorSpace=jn;let J=0,H=0,ht=null,j=-1,tt=null,rt=new Ie,ft=new Ie,dt=null,et=new he(0),gt=0,yt=e.width,Ct=e.height,Mt=1,Xt=null,oe=null,Ht=new Ie(0,0,yt,Ct),pe=new Ie(0,0,yt,Ct),ue=!1,se=new tr,$e=new Mc,Ve=!1,an=!1,Ue=new be,En=new k,Se=new Ie,xn={background:null,fog:null,environment:null,overrideMaterial:null,isScene:!0},je=!1;function ln(){return ht===null?Mt:1}let O=n;function It(w,B){return e.getContext(w,B)}let Kt,ae,wt,Be,Gt,Yt,C,S,Y,ut,at,xt,vt,nt,st,mt,U,ot,it,Tt,_t,bt,Wt;try{let w={alpha:!0,depth:s,stencil:r,antialias:a,premultipliedAlpha:l,preserveDrawingBuffer:c,powerPreference:u,failIfMajorPerformanceCaveat:h};if("setAttribute"in e&&e.setAttribute("data-engine",`three.js r${"187"}`),e.addEventListener("webglcontextlost",kt,!1),e.addEventListener("webglcontextrestored",te,!1),e.addEventListener("webglcontextcreationerror",Rt,!1),O===null){let B="webgl2";if(O=It(B,w),O===null)throw It(B)?new Error("THREE.WebGLRenderer: Error creating WebGL context with your selected attributes."):new Error("THREE.WebGLRenderer: Error creating WebGL context.")}Qt()}catch(w){throw e.removeEventListener("webglcontextlost",kt,!1),e.removeEventListener("webglcontextrestored",te,!1),e.removeEventListener("webglcontextcreationerror",Rt,!1),ee("WebGLRenderer: "+w.message),w}function Qt(){Kt=new JS(O),Kt.init(),_t=new DM(O,Kt),ae=new zS(O,Kt,t,_t),wt=new PM(O,Kt),ae.reversedDepthBuffer&&d&&wt.buffers.depth.setReversed(!0),q=O.createFramebuffer(),D=O.createFramebuffer(),W=O.createFramebuffer(),Be=new tb(O),Gt=new _M,Yt=new LM(O,Kt,wt,Gt,ae,_t,Be),C=new ZS(N),S=new ny(O),bt=new BS(O,S),Y=new jS(O,S,Be,bt),ut=new nb(O,Y,S,bt,Be),ot=new eb(O,ae,Yt),st=new VS(Gt),at=new gM(N,C,Kt,ae,bt,st),xt=new FM(N,Gt),vt=new yM,nt=new TM(Kt),U=new FS(N,C,wt,ut,m,l),mt=new IM(N,ut,ae),Wt=new BM(O,Be,ae,wt),it=new kS(O,Kt,Be),Tt=new QS(O,Kt,Be),Be.programs=at.programs,N.capabilities=ae,N.extensions=Kt,N.properties=Gt,N.renderLists=vt,N.shadowMap=mt,N.state=wt,N.info=Be}y!==oi&&(V=new sb(y,e.width,e.height,a,s,r));let ct=new Jd(N,O);this.xr=ct,this.getContext=function(){return O},this.getContextAttributes=function(){return O.getContextAttributes()},this.forceContextLoss=function(){let w=Kt.get("WEBGL_lose_context");w&&w.loseContext()},this.forceContextRestore=function(){let w=Kt.get("WEBGL_lose_context");w&&w.restoreContext()},this.getPixelRatio=function(){return Mt},this.setPixelRatio=function(w){w!==void 0&&(Mt=w,this.setSize(yt,Ct,!1))},this.getSize=function(w){return w.set(yt,Ct)},this.setSize=function(w,B,Q=!0){if(ct.isPresenting){$t("WebGLRenderer: Can't change size while VR device is presenting.");return}yt=w,Ct=B,e.width=Math.floor(w*Mt),e.height=Math.floor(B*Mt),Q===!0&&(e.style.width=w+"px",e.style.height=B+"px"),V!==null&&V.setSize(e.width,e.height),this.setViewport(0,0,w,B)},this.getDrawingBufferSize=function(w){return w.set(yt*Mt,Ct*Mt).floor()},this.setDrawingBufferSize=function(w,B,Q){yt=w,Ct=B,Mt=Q,e.width=Math.floor(w*Q),e.height=Math.floor(B*Q),this.setViewport(0,0,w,B)},this.setEffects=function(w){if(y===oi){ee("WebGLRenderer: setEffects() requires outputBufferType set to HalfFloatType or FloatType.");return}if(w){for(let B=0;B<w.length;B++)if(w[B].isOutputPass===!0){$t("WebGLRenderer: OutputPass is not needed in setEffects(). Tone mapping and color space conversion are applied automatically.");break}}V.setEffects(w||[])},this.getCurrentViewport=function(w){return w.copy(rt)},this.getViewport=function(w){return w.copy(Ht)},this.setViewport=function(w,B,Q,$){w.isVector4?Ht.set(w.x,w.y,w.z,w.w):Ht.set(w,B,Q,$),wt.viewport(rt.copy(Ht).multiplyScalar(ln()).round())},this.getScissor=function(w){return w.copy(pe)},this.setScissor=function(w,B,Q,$){w.isVector4?pe.set(w.x,w.y,w.z,w.w):pe.set(w,B,Q,$),wt.scissor(ft.copy(pe).multiplyScalar(ln()).round())},this.getScissorTest=function(){return ue},this.setScissorTest=function(w){wt.setScissorTest(ue=w)},this.setOpaqueSort=function(w){Xt=w},this.setTransparentSort=function(w){oe=w},this.getClearColor=function(w){return w.copy(U.getClearColor())},this.setClearColor=function(){U.setClearColor(...arguments)},this.getClearAlpha=function(){return U.getClearAlpha()},this.setClearAlpha=function(){U.setClearAlpha(...arguments)},this.clear=function(w=!0,B=!0,Q=!0){let $=0;if(w){let K=!1;if(ht!==null){let At=ht.texture.format;K=p.has(At)}if(K){let At=ht.texture.type,Lt=g.has(At),Et=U.getClearColor(),Dt=U.getClearAlpha(),Vt=Et.r,ne=Et.g,me=Et.b;Lt?(v[0]=Vt,v[1]=ne,v[2]=me,v[3]=Dt,O.clearBufferuiv(O.COLOR,0,v)):(E[0]=Vt,E[1]=ne,E[2]=me,E[3]=Dt,O.clearBufferiv(O.COLOR,0,E))}else $|=O.COLOR_BUFFER_BIT}B&&($|=O.DEPTH_BUFFER_BIT,this.state.buffers.depth.setMask(!0)),Q&&($|=O.STENCIL_BUFFER_BIT,this.state.buffers.stencil.setMask(4294967295)),$!==0&&O.clear($)},this.clearColor=function(){this.clear(!0,!1,!1)},this.clearDepth=function(){this.clear(!1,!0,!1)},this.clearStencil=function(){this.clear(!1,!1,!0)},this.setNodesHandler=function(w){w.setRenderer(this),X=w},this.dispose=function(){e.removeEventListener("webglcontextlost",kt,!1),e.removeEventListener("webglcontextrestored",te,!1),e.removeEventListener("webglcontextcreationerror",Rt,!1),U.dispose(),vt.dispose(),nt.dispose(),Yt.dispose(),Gt.dispose(),C.dispose(),ut.dispose(),Y.dispose(),bt.dispose(),Wt.dispose(),at.dispose(),ct.dispose(),ct.removeEventListener("sessionstart",El),ct.removeEventListener("sessionend",Qi),_s.stop()};function kt(w){w.preventDefault(),Ta("WebGLRenderer: Context Lost."),L=!0}function te(){Ta("WebGLRenderer: Context Restored."),L=!1;let w=Be.autoReset,B=mt.enabled,Q=mt.autoUpdate,$=mt.needsUpdate,K=mt.type;Qt(),Be.autoReset=w,mt.enabled=B,mt.autoUpdate=Q,mt.needsUpdate=$,mt.type=K}function Rt(w){ee("WebGLRenderer: A WebGL context could not be created. Reason: ",w.statusMessage)}function ce(w){let B=w.target;B.removeEventListener("dispose",ce),Ge(B)}function Ge(w){Xn(w),Gt.remove(w)}function Xn(w){let B=Gt.get(w).programs;B!==void 0&&(B.forEach(function(Q){at.releaseProgram(Q)}),w.isShaderMaterial&&at.releaseShaderCache(w))}this.renderBufferDirect=function(w,B,Q,$,K,At){B===null&&(B=xn);let Lt=K.isMesh&&K.matrixWorld.determinantAffine()<0,Et=ca(w,B,Q,$,K);wt.setMaterial($,Lt);let Dt=Q.index,Vt=1;if($.wireframe===!0){if(Dt=Y.getWireframeAttribute(Q),Dt===void 0)return;Vt=2}let ne=Q.drawRange,me=Q.attributes.position,zt=ne.start*Vt,ge=(ne.start+ne.count)*Vt;At!==null&&(zt=Math.max(zt,At.start*Vt),ge=Math.min(ge,(At.start+At.count)*Vt)),Dt!==null?(zt=Math.max(zt,0),ge=Math.min(ge,Dt.count)):me!=null&&(zt=Math.max(zt,0),ge=Math.min(ge,me.count));let Ze=ge-zt;if(Ze<0||Ze===1/0)return;bt.setup(K,$,Et,Q,Dt);let Le,De=it;if(Dt!==null&&(Le=S.get(Dt),De=Tt,De.setIndex(Le)),K.isMesh)$.wireframe===!0?(wt.setLineWidth($.wireframeLinewidth*ln()),De.setMode(O.LINES)):De.setMode(O.TRIANGLES);else if(K.isLine){let yn=$.linewidth;yn===void 0&&(yn=1),wt.setLineWidth(yn*ln()),K.isLineSegments?De.setMode(O.LINES):K.isLineLoop?De.setMode(O.LINE_LOOP):De.setMode(O.LINE_STRIP)}else K.isPoints?De.setMode(O.POINTS):K.isSprite&&De.setMode(O.TRIANGLES);if(K.isBatchedMesh)if(Kt.get("WEBGL_multi_draw"))De.renderMultiDraw(K._multiDrawStarts,K._multiDrawCounts,K._multiDrawCount);else{let yn=K._multiDrawStarts,Ft=K._multiDrawCounts,cn=K._multiDrawCount,xe=Dt?S.get(Dt).bytesPerElement:1,ys=Gt.get($).currentProgram.getUniforms();for(let hn=0;hn<cn;hn++)ys.setValue(O,"_gl_DrawID",hn),De.render(yn[hn]/xe,Ft[hn])}else if(K.isInstancedMesh)De.renderInstances(zt,Ze,K.count);else if(Q.isInstancedBufferGeometry){let yn=Q._maxInstanceCount!==void 0?Q._maxInstanceCount:1/0,Ft=Math.min(Q.instanceCount,yn);De.renderInstances(zt,Ze,Ft)}else De.render(zt,Ze)};function oa(w,B,Q,$){X!==null&&w.isNodeMaterial&&X.setObject($,w),Ve===!0&&st.setState(w,Q,!1),w.transparent===!0&&w.side===ri&&w.forceSinglePass===!1?(w.side=ni,w.needsUpdate=!0,ts(w,B,$),w.side=lr,w.needsUpdate=!0,ts(w,B,$),w.side=ri):ts(w,B,$)}this.compile=function(w,B,Q=null){Q===null&&(Q=w),X!==null&&X.renderStart(w,B,Q),A=nt.get(Q),A.init(B),T.push(A),Q.traverseVisible(function(K){K.isLight&&K.layers.test(B.layers)&&(A.pushLight(K),K.castShadow&&A.pushShadow(K))}),w!==Q&&w.traverseVisible(function(K){K.isLight&&K.layers.test(B.layers)&&(A.pushLight(K),K.castShadow&&A.pushShadow(K))}),A.setupLights(),X!==null&&X.updateLights(A.state.lightsArray),an=this.localClippingEnabled,Ve=st.init(this.clippingPlanes,an),Ve===!0&&st.setGlobalState(this.clippingPlanes,B),X!==null&&mt.render(A.state.shadowsArray,Q,B);let $=new Set;return w.traverse(function(K){if(!(K.isMesh||K.isPoints||K.isLine||K.isSprite))return;let At=K.material;if(At)if(Array.isArray(At))for(let Lt=0;Lt<At.length;Lt++){let Et=At[Lt];oa(Et,Q,B,K),$.add(Et)}else oa(At,Q,B,K),$.add(At)}),A=T.pop(),X!==null&&X.renderEnd(),$},this.compileAsync=function(w,B,Q=null){let $=this.compile(w,B,Q);return new Promise(K=>{function At(){if($.forEach(function(Lt){let Dt=Gt.get(Lt).currentProgram;(Dt===void 0||Dt.isReady())&&$.delete(Lt)}),$.size===0){K(w);return}setTimeout(At,10)}Kt.get("KHR_parallel_shader_compile")!==null?At():setTimeout(At,10)})};let Wr=null;function yu(w){Wr&&Wr(w)}function El(){_s.stop()}function Qi(){_s.start()}let _s=new fg;_s.setAnimationLoop(yu),typeof self<"u"&&_s.setContext(self),this.setAnimationLoop=function(w){Wr=w,ct.setAnimationLoop(w),w===null?_s.stop():_s.start()},ct.addEventListener("sessionstart",El),ct.addEventListener("sessionend",Qi),this.render=function(w,B){if(B!==void 0&&B.isCamera!==!0){ee("WebGLRenderer.render: camera is not an instance of THREE.Camera.");return}if(L===!0)return;X!==null&&X.renderStart(w,B);let Q=ct.enabled===!0&&ct.isPresenting===!0,$=V!==null&&(ht===null||Q)&&V.begin(N,ht);if(w.matrixWorldAutoUpdate===!0&&w.updateMatrixWorld(),B.parent===null&&B.matrixWorldAutoUpdate===!0&&B.updateMatrixWorld(),ct.enabled===!0&&ct.isPresenting===!0&&(V===null||V.isCompositing()===!1)&&(ct.cameraAutoUpdate===!0&&ct.updateCamera(B),B=ct.getCamera()),w.isScene===!0&&w.onBeforeRender(N,w,B,ht),A=nt.get(w,T.length),A.init(B),A.state.textureUnits=Yt.getTextureUnits(),T.push(A),Ue.multiplyMatrices(B.projectionMatrix,B.matrixWorldInverse),B.isArrayCamera?$e.setFromArrayCamera(B):se.setFromProjectionMatrix(Ue,Ei,B.reversedDepth),an=this.localClippingEnabled,Ve=st.init(this.clippingPlanes,an),I=vt.get(w,x.length),I.init(),x.push(I),this.info.render.frame++,ct.enabled===!0&&ct.isPresenting===!0){let Lt=N.xr.getDepthSensingMesh();Lt!==null&&xs(Lt,B,-1/0,N.sortObjects)}xs(w,B,0,N.sortObjects),I.finish(),X!==null&&X.updateLights(A.state.lightsArray),N.sortObjects===!0&&I.sort(Xt,oe),je=ct.enabled===!1||ct.isPresenting===!1||ct.hasDepthSensing()===!1,je&&U.addToRenderList(I,w),this.info.autoReset===!0&&this.info.reset(),Ve===!0&&st.beginShadows();let K=A.state.shadowsArray;if(mt.render(K,w,B),Ve===!0&&st.endShadows(),($&&V.hasRenderPass())===!1){let Lt=I.opaque,Et=I.transmissive;if(A.setupLights(),B.isArrayCamera){let Dt=B.cameras;if(Et.length>0)for(let Vt=0,ne=Dt.length;Vt<ne;Vt++){let me=Dt[Vt];Di(Lt,Et,w,me)}je&&U.render(w);for(let Vt=0,ne=Dt.length;Vt<ne;Vt++){let me=Dt[Vt];aa(I,w,me,me.viewport)}}else Et.length>0&&Di(Lt,Et,w,B),je&&U.render(w),aa(I,w,B)}ht!==null&&H===0&&(Yt.updateMultisampleRenderTarget(ht),Yt.updateRenderTargetMipmap(ht)),$&&V.end(N),w.isScene===!0&&w.onAfterRender(N,w,B),bt.resetDefaultState(),j=-1,tt=null,T.pop(),T.length>0?(A=T[T.length-1],Yt.setTextureUnits(A.state.textureUnits),Ve===!0&&st.setGlobalState(N.clippingPlanes,A.state.camera)):A=null,x.pop(),x.length>0?I=x[x.length-1]:I=null,X!==null&&X.renderEnd()};function xs(w,B,Q,$){if(w.visible===!1)return;if(w.layers.test(B.layers)){if(w.isGroup)Q=w.renderOrder;else if(w.isLOD)w.autoUpdate===!0&&w.update(B);else if(w.isLight)A.pushLight(w),w.castShadow&&A.pushShadow(w);else if(w.isSprite){let Lt=B.isArrayCamera?$e:se;if(!w.frustumCulled||w.intersectsFrustum(Lt)){$&&Se.setFromMatrixPosition(w.matrixWorld).applyMatrix4(Ue);let Et=ut.update(w),Dt=w.material;Dt.visible&&I.push(w,Et,Dt,Q,Se.z,null,B)}}else if(w.isMesh||w.isLine||w.isPoints){let Lt=B.isArrayCamera?$e:se;if(!w.frustumCulled||w.intersectsFrustum(Lt)){let Et=ut.update(w),Dt=w.material;if($&&(w.boundingSphere!==void 0?(w.boundingSphere===null&&w.computeBoundingSphere(),Se.copy(w.boundingSphere.center)):(Et.boundingSphere===null&&Et.computeBoundingSphere(),Se.copy(Et.boundingSphere.center)),Se.applyMatrix4(w.matrixWorld).applyMatrix4(Ue)),Array.isArray(Dt)){let Vt=Et.groups;for(let ne=0,me=Vt.length;ne<me;ne++){let zt=Vt[ne],ge=Dt[zt.materialIndex];ge&&ge.visible&&I.push(w,Et,ge,Q,Se.z,zt,B)}}else Dt.visible&&I.push(w,Et,Dt,Q,Se.z,null,B)}}}let At=w.children;for(let Lt=0,Et=At.length;Lt<Et;Lt++)xs(At[Lt],B,Q,$)}function aa(w,B,Q,$){let{opaque:K,transmissive:At,transparent:Lt}=w;A.setupLightsView(Q),Ve===!0&&st.setGlobalState(N.clippingPlanes,Q),$&&wt.viewport(rt.copy($)),K.length>0&&Qe(K,B,Q),At.length>0&&Qe(At,B,Q),Lt.length>0&&Qe(Lt,B,Q),wt.buffers.depth.setTest(!0),wt.buffers.depth.setMask(!0),wt.buffers.color.setMask(!0),wt.setPolygonOffset(!1)}function Di(w,B,Q,$){if((Q.isScene===!0?Q.overrideMaterial:null)!==null)return;if(A.state.transmissionRenderTarget[$.id]===void 0){let zt=Kt.has("EXT_color_buffer_half_float")||Kt.has("EXT_color_buffer_float");A.state.transmissionRenderTarget[$.id]=new xi(1,1,{generateMipmaps:!0,type:zt?Wi:oi,minFilter:Us,samples:Math.max(4,ae.samples),stencilBuffer:r,resolveDepthBuffer:!1,resolveStencilBuffer:!1,storeMultisampledDepthBuffer:!1,storeMultisampledStencilBuffer:!1,colorSpace:ye.workingColorSpace})}let At=A.state.transmissionRenderTarget[$.id],Lt=$.viewport||rt;At.setSize(Lt.z*N.transmissionResolutionScale,Lt.w*N.transmissionResolutionScale);let Et=N.getRenderTarget(),Dt=N.getActiveCubeFace(),Vt=N.getActiveMipmapLevel();N.setRenderTarget(At),N.getClearColor(et),gt=N.getClearAlpha(),gt<1&&N.setClearColor(16777215,.5),N.clear(),je&&U.render(Q);let ne=N.toneMapping;N.toneMapping=us;let me=$.viewport;if($.viewport!==void 0&&($.viewport=void 0),A.setupLightsView($),Ve===!0&&st.setGlobalState(N.clippingPlanes,$),Qe(w,Q,$),Yt.updateMultisampleRenderTarget(At),Yt.updateRenderTargetMipmap(At),Kt.has("WEBGL_multisampled_render_to_texture")===!1){let zt=!1;for(let ge=0,Ze=B.length;ge<Ze;ge++){let Le=B[ge],{object:De,geometry:yn,material:Ft,group:cn}=Le;if(Ft.side===ri&&De.layers.test($.layers)){let xe=Ft.side;Ft.side=ni,Ft.needsUpdate=!0,rn(De,Q,$,yn,Ft,cn),Ft.side=xe,Ft.needsUpdate=!0,zt=!0}}zt===!0&&(Yt.updateMultisampleRenderTarget(At),Yt.updateRenderTargetMipmap(At))}N.setRenderTarget(Et,Dt,Vt),N.setClearColor(et,gt),me!==void 0&&($.viewport=me),N.toneMapping=ne}function Qe(w,B,Q){let $=B.isScene===!0?B.overrideMaterial:null;for(let K=0,At=w.length;K<At;K++){let Lt=w[K],{object:Et,geometry:Dt,group:Vt}=Lt,ne=Lt.material;ne.allowOverride===!0&&$!==null&&(ne=$),Et.layers.test(Q.layers)&&rn(Et,B,Q,Dt,ne,Vt)}}function rn(w,B,Q,$,K,At){X!==null&&K.isNodeMaterial&&X.setObject(w,K),w.onBeforeRender(N,B,Q,$,K,At),w.modelViewMatrix.multiplyMatrices(Q.matrixWorldInverse,w.matrixWorld),w.normalMatrix.getNormalMatrix(w.modelViewMatrix),K.onBeforeRender(N,B,Q,$,w,At),K.transparent===!0&&K.side===ri&&K.forceSinglePass===!1?(K.side=ni,K.needsUpdate=!0,N.renderBufferDirect(Q,B,$,K,w,At),K.side=lr,K.needsUpdate=!0,N.renderBufferDirect(Q,B,$,K,w,At),K.side=ri):N.renderBufferDirect(Q,B,$,K,w,At),w.onAfterRender(N,B,Q,$,K,At)}function on(w){let B=0;for(let Q of w)Q.texture!==null&&B++;return B}function ts(w,B,Q){B.isScene!==!0&&(B=xn);let $=Gt.get(w),K=A.state.lights,At=A.state.shadowsArray,Lt=K.state.version,Et=at.getParameters(w,K.state,At,B,Q,A.state.lightProbeGridArray),Dt=at.getProgramCacheKey(Et),Vt=$.programs;$.environment=w.isMeshStandardMaterial||w.isMeshLambertMaterial||w.isMeshPhongMaterial?B.environment:null,$.fog=B.fog;let ne=w.isMeshStandardMaterial||w.isMeshLambertMaterial&&!w.envMap||w.isMeshPhongMaterial&&!w.envMap;$.envMap=C.get(w.envMap||$.environment,ne),$.envMapRotation=$.environment!==null&&w.envMap===null?B.environmentRotation:w.envMapRotation,Vt===void 0&&(w.addEventListener("dispose",ce),Vt=new Map,$.programs=Vt,$.programVariants=new Map);let me=Vt.get(Dt);if(me!==void 0){if($.currentProgram===me&&$.lightsStateVersion===Lt)return la(w,Et),me}else Et.uniforms=at.getUniforms(w),X!==null&&w.isNodeMaterial&&X.build(w,Q,Et),w.onBeforeCompile(Et,N),me=at.acquireProgram(Et,Dt),Vt.set(Dt,me),$.uniforms=Et.uniforms;let zt=$.uniforms;return(!w.isShaderMaterial&&!w.isRawShaderMaterial||w.clipping===!0)&&(zt.clippingPlanes=st.uniform),la(w,Et),$.needsLights=Hs(w),$.lightsStateVersion=Lt,$.needsLights&&(zt.ambientLightColor.value=K.state.ambient,zt.lightProbe.value=K.state.probe,zt.sunLights.value=K.state.sun,zt.sunLightShadows.value=K.state.sunShadow,zt.directionalLights.value=K.state.directional,zt.directionalLightShadows.value=K.state.directionalShadow,zt.spotLights.value=K.state.spot,zt.spotLightShadows.value=K.state.spotShadow,zt.rectAreaLights.value=K.state.rectArea,zt.ltc_1.value=K.state.rectAreaLTC1,zt.ltc_2.value=K.state.rectAreaLTC2,zt.pointLights.value=K.state.point,zt.pointLightShadows.value=K.state.pointShadow,zt.hemisphereLights.value=K.state.hemi,zt.sunShadowMatrix.value=K.state.sunShadowMatrix,zt.sunShadowCascade.value=K.state.sunShadowCascade,zt.directionalShadowMatrix.value=K.state.directionalShadowMatrix,zt.spotLightMatrix.value=K.state.spotLightMatrix,zt.spotLightMap.value=K.state.spotLightMap,zt.pointShadowMatrix.value=K.state.pointShadowMatrix),$.numLightProbeGrids=on(A.state.lightProbeGridArray),$.currentProgram=me,$.uniformsList=null,me}function ui(w,B,Q,$,K){let At=Gt.get(w),Lt=At.currentProgram.id+","+$+","+K,Et=At.programVariants.get(Lt);return Et===void 0?(Et=ts(w,B,Q),At.programVariants.set(Lt,Et)):(At.currentProgram=Et,At.uniformsList=null,At.outputColorSpace=$,At.toneMapping=K),Et}function Gs(w){if(w.uniformsList===null){let B=w.currentProgram.getUniforms();w.uniformsList=Vo.seqWithValue(B.seq,w.uniforms)}return w.uniformsList}function la(w,B){let Q=Gt.get(w);Q.outputColorSpace=B.outputColorSpace,Q.batching=B.batching,Q.batchingColor=B.batchingColor,Q.instancing=B.instancing,Q.instancingColor=B.instancingColor,Q.instancingMorph=B.instancingMorph,Q.skinning=B.skinning,Q.morphTargets=B.morphTargets,Q.morphNormals=B.morphNormals,Q.morphColors=B.morphColors,Q.morphTargetsCount=B.morphTargetsCount,Q.numClippingPlanes=B.numClippingPlanes,Q.numIntersection=B.numClipIntersection,Q.vertexAlphas=B.vertexAlphas,Q.vertexTangents=B.vertexTangents,Q.toneMapping=B.toneMapping}function ca(w,B,Q,$,K){B.isScene!==!0&&(B=xn),Yt.resetTextureUnits();let At=B.fog,Lt=$.isMeshStandardMaterial||$.isMeshLambertMaterial||$.isMeshPhongMaterial?B.environment:null,Et=ht===null?N.outputColorSpace:ht.isXRRenderTarget===!0?ht.texture.colorSpace:ye.workingColorSpace,Dt=$.isMeshStandardMaterial||$.isMeshLambertMaterial&&!$.envMap||$.isMeshPhongMaterial&&!$.envMap,Vt=C.get($.envMap||Lt,Dt),ne=$.vertexColors===!0&&!!Q.attributes.color&&Q.attributes.color.itemSize===4,me=!!Q.attributes.tangent&&(!!$.normalMap||$.anisotropy>0),zt=!!Q.morphAttributes.position,ge=!!Q.morphAttributes.normal,Ze=!!Q.morphAttributes.color,Le=us;$.toneMapped&&(ht===null||ht.isXRRenderTarget===!0)&&(Le=N.toneMapping);let De=Q.morphAttributes.position||Q.morphAttributes.normal||Q.morphAttributes.color,yn=De!==void 0?De.length:0,Ft=Gt.get($),cn=A.state.lights;if(Ve===!0&&(an===!0||w!==tt)){let Ne=w===tt&&$.id===j;st.setState($,w,Ne)}let xe=!1,ys=!1;$.version===Ft.__version?Ft.needsLights&&Ft.lightsStateVersion!==cn.state.version||K.isBatchedMesh&&Ft.batching===!1||!K.isBatchedMesh&&Ft.batching===!0||K.isBatchedMesh&&Ft.batchingColor===!0&&K._colorsTexture===null||K.isBatchedMesh&&Ft.batchingColor===!1&&K._colorsTexture!==null||K.isInstancedMesh&&Ft.instancing===!1||!K.isInstancedMesh&&Ft.instancing===!0||K.isSkinnedMesh&&Ft.skinning===!1||!K.isSkinnedMesh&&Ft.skinning===!0||K.isInstancedMesh&&Ft.instancingColor===!0&&K.instanceColor===null||K.isInstancedMesh&&Ft.instancingColor===!1&&K.instanceColor!==null||K.isInstancedMesh&&Ft.instancingMorph===!0&&K.morphTexture===null||K.isInstancedMesh&&Ft.instancingMorph===!1&&K.morphTexture!==null||Ft.envMap!==Vt||$.fog===!0&&Ft.fog!==At||Ft.numClippingPlanes!==void 0&&(Ft.numClippingPlanes!==st.numPlanes||Ft.numIntersection!==st.numIntersection)||Ft.vertexAlphas!==ne||Ft.vertexTangents!==me||Ft.morphTargets!==zt||Ft.morphNormals!==ge||Ft.morphColors!==Ze||Ft.morphTargetsCount!==yn||Ft.numLightProbeGrids!==on(A.state.lightProbeGridArray)?xe=!0:(Ft.outputColorSpace!==Et||Ft.toneMapping!==Le)&&(ys=!0):(xe=!0,Ft.__version=$.version);let hn=Ft.currentProgram;(xe===!0||ys===!0)&&(hn=ys===!0?ui($,B,K,Et,Le):ts($,B,K),X&&$.isNodeMaterial&&X.onUpdateProgram($,hn,Ft));let Yr=!1,es=!1,vs=!1,de=hn.getUniforms(),tn=Ft.uniforms;if(wt.useProgram(hn.program)&&(Yr=!0,es=!0,vs=!0),$.id!==j&&(j=$.id,es=!0),Yr||tt!==w){wt.buffers.depth.getReversed()&&w.reversedDepth!==!0&&(w._reversedDepth=!0,w.updateProjectionMatrix()),de.setValue(O,"projectionMatrix",w.projectionMatrix),de.setValue(O,"viewMatrix",w.matrixWorldInverse);let un=de.map.cameraPosition;un!==void 0&&un.setValue(O,En.setFromMatrixPosition(w.matrixWorld)),ae.logarithmicDepthBuffer&&de.setValue(O,"logDepthBufFC",2/(Math.log(w.far+1)/Math.LN2)),($.isMeshPhongMaterial||$.isMeshToonMaterial||$.isMeshLambertMaterial||$.isMeshBasicMaterial||$.isMeshStandardMaterial||$.isShaderMaterial)&&de.setValue(O,"isOrthographic",w.isOrthographicCamera===!0),tt!==w&&(tt=w,es=!0,vs=!0)}if(Ft.needsLights&&(cn.state.sunShadowMap.length>0&&de.setValue(O,"sunShadowMap",cn.state.sunShadowMap,Yt),cn.state.directionalShadowMap.length>0&&de.setValue(O,"directionalShadowMap",cn.state.directionalShadowMap,Yt),cn.state.spotShadowMap.length>0&&de.setValue(O,"spotShadowMap",cn.state.spotShadowMap,Yt),cn.state.pointShadowMap.length>0&&de.setValue(O,"pointShadowMap",cn.state.pointShadowMap,Yt)),K.isSkinnedMesh){de.setOptional(O,K,"bindMatrix"),de.setOptional(O,K,"bindMatrixInverse");let Ne=K.skeleton;Ne&&(Ne.boneTexture===null&&Ne.computeBoneTexture(),de.setValue(O,"boneTexture",Ne.boneTexture,Yt))}K.isBatchedMesh&&(de.setOptional(O,K,"batchingTexture"),de.setValue(O,"batchingTexture",K._matricesTexture,Yt),de.setOptional(O,K,"batchingIdTexture"),de.setValue(O,"batchingIdTexture",K._indirectTexture,Yt),de.setOptional(O,K,"batchingColorTexture"),K._colorsTexture!==null&&de.setValue(O,"batchingColorTexture",K._colorsTexture,Yt));let qn=Q.morphAttributes;if((qn.position!==void 0||qn.normal!==void 0||qn.color!==void 0)&&ot.update(K,Q,hn),(es||Ft.receiveShadow!==K.receiveShadow)&&(Ft.receiveShadow=K.receiveShadow,de.setValue(O,"receiveShadow",K.receiveShadow)),($.isMeshStandardMaterial||$.isMeshLambertMaterial||$.isMeshPhongMaterial)&&$.envMap===null&&B.environment!==null&&(tn.envMapIntensity.value=B.environmentIntensity),tn.dfgLUT!==void 0&&(tn.dfgLUT.value=zM()),es){if(de.setValue(O,"toneMappingExposure",N.toneMappingExposure),Ft.needsLights&&Xr(tn,vs),At&&$.fog===!0&&xt.refreshFogUniforms(tn,At),xt.refreshMaterialUniforms(tn,$,Mt,Ct,A.state.transmissionRenderTarget[w.id]),Ft.needsLights&&Ft.numLightProbeGrids>0){let Ne=b,un=0;for(let zn of A.state.lightProbeGridArray)zn.texture!==null&&(Ne.textures[un]=zn.texture,Ne.min[un]=zn.boundingBox.min,Ne.max[un]=zn.boundingBox.max,Ne.resolution[un]=zn.resolution,un++);for(let zn in Ne)Ne[zn].length=un;tn.probesSH.value=Ne.textures,tn.probesMin.value=Ne.min,tn.probesMax.value=Ne.max,tn.probesResolution.value=Ne.resolution}Vo.upload(O,Gs(Ft),tn,Yt)}if($.isShaderMaterial&&$.uniformsNeedUpdate===!0&&(Vo.upload(O,Gs(Ft),tn,Yt),$.uniformsNeedUpdate=!1),$.isSpriteMaterial&&de.setValue(O,"center",K.center),de.setValue(O,"modelViewMatrix",K.modelViewMatrix),de.setValue(O,"normalMatrix",K.normalMatrix),de.setValue(O,"modelMatrix",K.matrixWorld),$.uniformsGroups!==void 0){let Ne=$.uniformsGroups;for(let un=0,zn=Ne.length;un<zn;un++){let Cl=Ne[un];Wt.update(Cl,hn),Wt.bind(Cl,hn)}}return hn}function Xr(w,B){w.ambientLightColor.needsUpdate=B,w.lightProbe.needsUpdate=B,w.sunLights.needsUpdate=B,w.sunLightShadows.needsUpdate=B,w.directionalLights.needsUpdate=B,w.directionalLightShadows.needsUpdate=B,w.pointLights.needsUpdate=B,w.pointLightShadows.needsUpdate=B,w.spotLights.needsUpdate=B,w.spotLightShadows.needsUpdate=B,w.rectAreaLights.needsUpdate=B,w.hemisphereLights.needsUpdate=B}function Hs(w){return w.isMeshLambertMaterial||w.isMeshToonMaterial||w.isMeshPhongMaterial||w.isMeshStandardMaterial||w.isShadowMaterial||w.isShaderMaterial&&w.lights===!0}this.getActiveCubeFace=function(){return J},this.getActiveMipmapLevel=function(){return H},this.getRenderTarget=function(){return ht},this.setRenderTargetTextures=function(w,B,Q){let $=Gt.get(w);$.__autoAllocateDepthBuffer=w.resolveDepthBuffer===!1,$.__autoAllocateDepthBuffer===!1&&($.__useRenderToTexture=!1),Gt.get(w.texture).__webglTexture=B,Gt.get(w.depthTexture).__webglTexture=$.__autoAllocateDepthBuffer?void 0:Q,$.__hasExternalTextures=!0},this.setRenderTargetFramebuffer=function(w,B){let Q=Gt.get(w);Q.__webglFramebuffer=B,Q.__useDefaultFramebuffer=B===void 0},this.setRenderTarget=function(w,B=0,Q=0){ht=w,J=B,H=Q;let $=null,K=!1,At=!1;if(w){let Et=Gt.get(w);if(Et.__useDefaultFramebuffer!==void 0){wt.bindFramebuffer(O.FRAMEBUFFER,Et.__webglFramebuffer),rt.copy(w.viewport),ft.copy(w.scissor),dt=w.scissorTest,wt.viewport(rt),wt.scissor(ft),wt.setScissorTest(dt),j=-1;return}else if(Et.__webglFramebuffer===void 0)Yt.setupRenderTarget(w);else if(Et.__hasExternalTextures)Yt.rebindTextures(w,Gt.get(w.texture).__webglTexture,Gt.get(w.depthTexture).__webglTexture);else if(w.depthBuffer){let ne=w.depthTexture;if(Et.__boundDepthTexture!==ne){if(ne!==null&&Gt.has(ne)&&(w.width!==ne.image.width||w.height!==ne.image.height))throw new Error("THREE.WebGLRenderer: Attached DepthTexture is initialized to the incorrect size.");Yt.setupDepthRenderbuffer(w)}}let Dt=w.texture;(Dt.isData3DTexture||Dt.isDataArrayTexture||Dt.isCompressedArrayTexture)&&(At=!0);let Vt=Gt.get(w).__webglFramebuffer;w.isWebGLCubeRenderTarget?(Array.isArray(Vt[B])?$=Vt[B][Q]:$=Vt[B],K=!0):w.samples>0&&Yt.useMultisampledRTT(w)===!1?$=Gt.get(w).__webglMultisampledFramebuffer:Array.isArray(Vt)?$=Vt[Q]:$=Vt,rt.copy(w.viewport),ft.copy(w.scissor),dt=w.scissorTest}else rt.copy(Ht).multiplyScalar(Mt).floor(),ft.copy(pe).multiplyScalar(Mt).floor(),dt=ue;if(Q!==0&&($=q),wt.bindFramebuffer(O.FRAMEBUFFER,$)&&wt.drawBuffers(w,$),wt.viewport(rt),wt.scissor(ft),wt.setScissorTest(dt),K){let Et=Gt.get(w.texture);O.framebufferTexture2D(O.FRAMEBUFFER,O.COLOR_ATTACHMENT0,O.TEXTURE_CUBE_MAP_POSITIVE_X+B,Et.__webglTexture,Q)}else if(At){let Et=B;for(let Dt=0;Dt<w.textures.length;Dt++){let Vt=Gt.get(w.textures[Dt]);O.framebufferTextureLayer(O.FRAMEBUFFER,O.COLOR_ATTACHMENT0+Dt,Vt.__webglTexture,Q,Et)}}else if(w!==null&&Q!==0){let Et=Gt.get(w.texture);O.framebufferTexture2D(O.FRAMEBUFFER,O.COLOR_ATTACHMENT0,O.TEXTURE_2D,Et.__webglTexture,Q)}j=-1};function qr(w){let B=Gt.get(w);return(B.__readFormat!==w.format||B.__readType!==w.type)&&(B.__readFormat=w.format,B.__readType=w.type,B.__formatReadable=ae.textureFormatReadable(w.format),B.__typeReadable=ae.textureTypeReadable(w.type)),B}this.readRenderTargetPixels=function(w,B,Q,$,K,At,Lt,Et=0){if(!(w&&w.isWebGLRenderTarget)){ee("WebGLRenderer.readRenderTargetPixels: renderTarget is not THREE.WebGLRenderTarget.");return}let Dt=Gt.get(w).__webglFramebuffer;if(w.isWebGLCubeRenderTarget&&Lt!==void 0&&(Dt=Dt[Lt],Array.isArray(Dt)&&(Dt=Dt[0])),Dt){wt.bindFramebuffer(O.FRAMEBUFFER,Dt);try{let Vt=w.textures[Et],ne=Vt.format,me=Vt.type;w.textures.length>1&&O.readBuffer(O.COLOR_ATTACHMENT0+Et);let zt=qr(Vt);if(zt.__formatReadable===!1){ee("WebGLRenderer.readRenderTargetPixels: renderTarget is not in RGBA or implementation defined format.");return}if(zt.__typeReadable===!1){ee("WebGLRenderer.readRenderTargetPixels: renderTarget is not in UnsignedByteType or implementation defined type.");return}B>=0&&B<=w.width-$&&Q>=0&&Q<=w.height-K&&O.readPixels(B,Q,$,K,_t.convert(ne),_t.convert(me),At)}finally{let Vt=ht!==null?Gt.get(ht).__webglFramebuffer:null;wt.bindFramebuffer(O.FRAMEBUFFER,Vt)}}},this.readRenderTargetPixelsAsync=async function(w,B,Q,$,K,At,Lt,Et=0){if(!(w&&w.isWebGLRenderTarget))throw new Error("THREE.WebGLRenderer.readRenderTargetPixels: renderTarget is not THREE.WebGLRenderTarget.");let Dt=Gt.get(w).__webglFramebuffer;if(w.isWebGLCubeRenderTarget&&Lt!==void 0&&(Dt=Dt[Lt],Array.isArray(Dt)&&(Dt=Dt[0])),Dt)if(B>=0&&B<=w.width-$&&Q>=0&&Q<=w.height-K){wt.bindFramebuffer(O.FRAMEBUFFER,Dt);let Vt=w.textures[Et],ne=Vt.format,me=Vt.type;w.textures.length>1&&O.readBuffer(O.COLOR_ATTACHMENT0+Et);let zt=qr(Vt);if(zt.__formatReadable===!1)throw new Error("THREE.WebGLRenderer.readRenderTargetPixelsAsync: renderTarget is not in RGBA or implementation defined format.");if(zt.__typeReadable===!1)throw new Error("THREE.WebGLRenderer.readRenderTargetPixelsAsync: renderTarget is not in UnsignedByteType or implementation defined type.");let ge=O.createBuffer();O.bindBuffer(O.PIXEL_PACK_BUFFER,ge),O.bufferData(O.PIXEL_PACK_BUFFER,At.byteLength,O.STREAM_READ),O.readPixels(B,Q,$,K,_t.convert(ne),_t.convert(me),0),O.bindBuffer(O.PIXEL_PACK_BUFFER,null);let Ze=ht!==null?Gt.get(ht).__webglFramebuffer:null;wt.bindFramebuffer(O.FRAMEBUFFER,Ze);let Le=O.fenceSync(O.SYNC_GPU_COMMANDS_COMPLETE,0);return O.flush(),await Vm(O,Le,4),O.bindBuffer(O.PIXEL_PACK_BUFFER,ge),O.getBufferSubData(O.PIXEL_PACK_BUFFER,0,At),O.bindBuffer(O.PIXEL_PACK_BUFFER,null),O.deleteBuffer(ge),O.deleteSync(Le),At}else throw new Error("THREE.WebGLRenderer.readRenderTargetPixelsAsync: requested read bounds are out of range.")},this.copyFramebufferToTexture=function(w,B=null,Q=0){let $=Math.pow(2,-Q),K=Math.floor(w.image.width*$),At=Math.floor(w.image.height*$),Lt=B!==null?B.x:0,Et=B!==null?B.y:0;Yt.setTexture2D(w,0),O.copyTexSubImage2D(O.TEXTURE_2D,Q,0,0,Lt,Et,K,At),wt.unbindTexture()},this.copyTextureToTexture=function(w,B,Q=null,$=null,K=0,At=0){let Lt,Et,Dt,Vt,ne,me,zt,ge,Ze,Le=w.isCompressedTexture?w.mipmaps[At]:w.image;if(Q!==null)Lt=Q.max.x-Q.min.x,Et=Q.max.y-Q.min.y,Dt=Q.isBox3?Q.max.z-Q.min.z:1,Vt=Q.min.x,ne=Q.min.y,me=Q.isBox3?Q.min.z:0;else{let de=Math.pow(2,-K);Lt=Math.floor(Le.width*de),Et=Math.floor(Le.height*de),w.isDataArrayTexture?Dt=Le.depth:w.isData3DTexture?Dt=Math.floor(Le.depth*de):Dt=1,Vt=0,ne=0,me=0}$!==null?(zt=$.x,ge=$.y,Ze=$.z):(zt=0,ge=0,Ze=0);let De=_t.convert(B.format),yn=_t.convert(B.type),Ft;B.isData3DTexture?(Yt.setTexture3D(B,0),Ft=O.TEXTURE_3D):B.isDataArrayTexture||B.isCompressedArrayTexture?(Yt.setTexture2DArray(B,0),Ft=O.TEXTURE_2D_ARRAY):(Yt.setTexture2D(B,0),Ft=O.TEXTURE_2D),wt.activeTexture(O.TEXTURE0),wt.pixelStorei(O.UNPACK_FLIP_Y_WEBGL,B.flipY),wt.pixelStorei(O.UNPACK_PREMULTIPLY_ALPHA_WEBGL,B.premultiplyAlpha),wt.pixelStorei(O.UNPACK_ALIGNMENT,B.unpackAlignment);let cn=wt.getParameter(O.UNPACK_ROW_LENGTH),xe=wt.getParameter(O.UNPACK_IMAGE_HEIGHT),ys=wt.getParameter(O.UNPACK_SKIP_PIXELS),hn=wt.getParameter(O.UNPACK_SKIP_ROWS),Yr=wt.getParameter(O.UNPACK_SKIP_IMAGES);wt.pixelStorei(O.UNPACK_ROW_LENGTH,Le.width),wt.pixelStorei(O.UNPACK_IMAGE_HEIGHT,Le.height),wt.pixelStorei(O.UNPACK_SKIP_PIXELS,Vt),wt.pixelStorei(O.UNPACK_SKIP_ROWS,ne),wt.pixelStorei(O.UNPACK_SKIP_IMAGES,me);let es=w.isDataArrayTexture||w.isData3DTexture,vs=B.isDataArrayTexture||B.isData3DTexture;if(w.isDepthTexture){let de=Gt.get(w),tn=Gt.get(B),qn=Gt.get(de.__renderTarget),Ne=Gt.get(tn.__renderTarget);wt.bindFramebuffer(O.READ_FRAMEBUFFER,qn.__webglFramebuffer),wt.bindFramebuffer(O.DRAW_FRAMEBUFFER,Ne.__webglFramebuffer);for(let un=0;un<Dt;un++)es&&(O.framebufferTextureLayer(O.READ_FRAMEBUFFER,O.COLOR_ATTACHMENT0,Gt.get(w).__webglTexture,K,me+un),O.framebufferTextureLayer(O.DRAW_FRAMEBUFFER,O.COLOR_ATTACHMENT0,Gt.get(B).__webglTexture,At,Ze+un)),O.blitFramebuffer(Vt,ne,Vt+Lt,ne+Et,zt,ge,zt+Lt,ge+Et,O.DEPTH_BUFFER_BIT,O.NEAREST);wt.bindFramebuffer(O.READ_FRAMEBUFFER,null),wt.bindFramebuffer(O.DRAW_FRAMEBUFFER,null)}else if(K!==0||w.isRenderTargetTexture||Gt.has(w)){let de=Gt.get(w),tn=Gt.get(B);wt.bindFramebuffer(O.READ_FRAMEBUFFER,D),wt.bindFramebuffer(O.DRAW_FRAMEBUFFER,W);for(let qn=0;qn<Dt;qn++)es?O.framebufferTextureLayer(O.READ_FRAMEBUFFER,O.COLOR_ATTACHMENT0,de.__webglTexture,K,me+qn):O.framebufferTexture2D(O.READ_FRAMEBUFFER,O.COLOR_ATTACHMENT0,O.TEXTURE_2D,de.__webglTexture,K),vs?O.framebufferTextureLayer(O.DRAW_FRAMEBUFFER,O.COLOR_ATTACHMENT0,tn.__webglTexture,At,Ze+qn):O.framebufferTexture2D(O.DRAW_FRAMEBUFFER,O.COLOR_ATTACHMENT0,O.TEXTURE_2D,tn.__webglTexture,At),K!==0?O.blitFramebuffer(Vt,ne,Vt+Lt,ne+Et,zt,ge,zt+Lt,ge+Et,O.COLOR_BUFFER_BIT,O.NEAREST):vs?O.copyTexSubImage3D(Ft,At,zt,ge,Ze+qn,Vt,ne,Lt,Et):O.copyTexSubImage2D(Ft,At,zt,ge,Vt,ne,Lt,Et);wt.bindFramebuffer(O.READ_FRAMEBUFFER,null),wt.bindFramebuffer(O.DRAW_FRAMEBUFFER,null)}else vs?w.isDataTexture||w.isData3DTexture?O.texSubImage3D(Ft,At,zt,ge,Ze,Lt,Et,Dt,De,yn,Le.data):B.isCompressedArrayTexture?O.compressedTexSubImage3D(Ft,At,zt,ge,Ze,Lt,Et,Dt,De,Le.data):O.texSubImage3D(Ft,At,zt,ge,Ze,Lt,Et,Dt,De,yn,Le):w.isDataTexture?O.texSubImage2D(O.TEXTURE_2D,At,zt,ge,Lt,Et,De,yn,Le.data):w.isCompressedTexture?O.compressedTexSubImage2D(O.TEXTURE_2D,At,zt,ge,Le.width,Le.height,De,Le.data):O.texSubImage2D(O.TEXTURE_2D,At,zt,ge,Lt,Et,De,yn,Le);wt.pixelStorei(O.UNPACK_ROW_LENGTH,cn),wt.pixelStorei(O.UNPACK_IMAGE_HEIGHT,xe),wt.pixelStorei(O.UNPACK_SKIP_PIXELS,ys),wt.pixelStorei(O.UNPACK_SKIP_ROWS,hn),wt.pixelStorei(O.UNPACK_SKIP_IMAGES,Yr),At===0&&B.generateMipmaps===!0&&B.mipmapsAutoUpdate===!0&&O.generateMipmap(Ft),wt.unbindTexture()},this.initRenderTarget=function(w){Gt.get(w).__webglFramebuffer===void 0&&Yt.setupRenderTarget(w)},this.initTexture=function(w){w.isCubeTexture?Yt.setTextureCube(w,0):w.isData3DTexture?Yt.setTexture3D(w,0):w.isDataArrayTexture||w.isCompressedArrayTexture?Yt.setTexture2DArray(w,0):Yt.setTexture2D(w,0),wt.unbindTexture()},this.resetState=function(){J=0,H=0,ht=null,wt.reset(),bt.reset()},typeof __THREE_DEVTOOLS__<"u"&&__THREE_DEVTOOLS__.dispatchEvent(new CustomEvent("observe",{detail:this}))}get coordinateSystem(){return Ei}get outputColorSpace(){return this._outputColorSpace}set outputColorSpace(t){this._outputColorSpace=t;let e=this.getContext();e.drawingBufferColorSpace=ye._getDrawingBufferColorSpace(t),e.unpackColorSpace=ye._getUnpackColorSpace()}};var VM={5121:[Uint8Array,1],5123:[Uint16Array,2],5125:[Uint32Array,4],5126:[Float32Array,4]},GM={SCALAR:1,VEC3:3};function wg(i){let e=new DataView(i.buffer,i.byteOffset,i.byteLength).getUint32(12,!0),n=new TextDecoder().decode(i.subarray(20,20+e)),s=JSON.parse(n),r=20+e+8,o=u=>{let h=s.accessors[u],d=s.bufferViews[h.bufferView],[f,m]=VM[h.componentType],y=h.count*GM[h.type],p=i.byteOffset+r+(d.byteOffset??0)+(h.byteOffset??0);return new f(i.buffer.slice(p,p+y*m))},a=new Map,l=new k,c=(u,h)=>{let d=s.nodes[u],f=d.matrix?new be().fromArray(d.matrix):new be().compose(new k(...d.translation??[0,0,0]),new Je(...d.rotation??[0,0,0,1]),new k(...d.scale??[1,1,1])),m=h.clone().multiply(f);for(let y of d.mesh==null?[]:s.meshes[d.mesh].primitives){let p=o(y.attributes.POSITION),g=s.materials?.[y.material]?.name??"",v=y.indices==null?Array.from({length:p.length/3},(E,b)=>b):o(y.indices);a.has(g)||a.set(g,[]);for(let E of v)l.fromArray(p,3*E).applyMatrix4(m),a.get(g).push(l.z,l.x,l.y)}for(let y of d.children??[])c(y,m)};for(let u of s.scenes[s.scene??0].nodes)c(u,new be);return[...a].map(([u,h])=>({material:u,corners:Float32Array.from(h)}))}var Wo={};ex(Wo,{Target:()=>hl,begin:()=>HM,default:()=>ew,describe:()=>WM,initSync:()=>tf});var hl=class{__destroy_into_raw(){let t=this.__wbg_ptr;return this.__wbg_ptr=0,Tg.unregister(this),t}free(){let t=this.__destroy_into_raw();Ae.__wbg_target_free(t,0)}corners(){let t=Ae.target_corners(this.__wbg_ptr);var e=XM(t[0],t[1]).slice();return Ae.__wbindgen_free(t[0],t[1]*4,4),e}cut(t,e,n,s,r){let o=+t,a=+s,l=+r,c,u,h,d;try{c=Ag(e,Ae.__wbindgen_malloc),u=Ho,h=Ag(n,Ae.__wbindgen_malloc),d=Ho}catch(y){throw h&&Ae.__wbindgen_free(h,d*8,8),c&&Ae.__wbindgen_free(c,u*8,8),y}let f=Ae.target_cut(this.__wbg_ptr,o,c,u,h,d,a,l);if(f[3])throw jd(f[2]);var m=qM(f[0],f[1]).slice();return Ae.__wbindgen_free(f[0],f[1]*8,8),m}glb(){let t=Ae.target_glb(this.__wbg_ptr);if(t[3])throw jd(t[2]);var e=YM(t[0],t[1]).slice();return Ae.__wbindgen_free(t[0],t[1]*1,1),e}constructor(t){let e=KM(t,Ae.__wbindgen_malloc,Ae.__wbindgen_realloc),n=Ho,s=Ae.target_new(e,n);if(s[2])throw jd(s[1]);return this.__wbg_ptr=s[0],Tg.register(this,this.__wbg_ptr,this),this}};Symbol.dispose&&(hl.prototype[Symbol.dispose]=hl.prototype.free);function HM(){Ae.begin()}function WM(){let i,t;try{let e=Ae.describe();return i=e[0],t=e[1],Uh(e[0],e[1])}finally{Ae.__wbindgen_free(i,t,1)}}function Eg(){return{__proto__:null,"./catseye_design_bg.js":{__proto__:null,__wbg_Error_208446807d0d1e30:function(t,e){return Error(Uh(t,e))},__wbg___wbindgen_throw_4c88d8bf264fd984:function(t,e){throw new Error(Uh(t,e))},__wbg_error_b22c914aecb2652f:function(t,e){console.error(Uh(t,e))},__wbindgen_init_externref_table:function(){let t=Ae.__wbindgen_externrefs;t.set(0,void 0),t.set(1024,void 0),t.set(1025,null),t.set(1026,!0),t.set(1027,!1)}}}}var Tg=typeof FinalizationRegistry>"u"?{register:()=>{},unregister:()=>{}}:new FinalizationRegistry(i=>Ae.__wbg_target_free(i,1));function XM(i,t){return i=i>>>0,$M().subarray(i/4,i/4+t)}function qM(i,t){return i=i>>>0,Cg().subarray(i/8,i/8+t)}function YM(i,t){return i=i>>>0,ll().subarray(i/1,i/1+t)}var rl=null;function $M(){return(rl===null||rl.byteLength===0)&&(rl=new Float32Array(Ae.memory.buffer)),rl}var ol=null;function Cg(){return(ol===null||ol.byteLength===0)&&(ol=new Float64Array(Ae.memory.buffer)),ol}function Uh(i,t){return i=i>>>0,JM(ll().subarray(i,i+t))}var al=null;function ll(){return(al===null||al.byteLength===0)&&(al=new Uint8Array(Ae.memory.buffer)),al}function Ag(i,t){let e=t(i.length*8,8)>>>0;return Cg().set(i,e/8),Ho=i.length,e}function KM(i,t,e){if(e===void 0){let a=cl.encode(i),l=t(a.length,1)>>>0;return ll().subarray(l,l+a.length).set(a),Ho=a.length,l}let n=i.length,s=t(n,1)>>>0,r=ll(),o=0;for(;o<n;o++){let a=i.charCodeAt(o);if(a>127)break;r[s+o]=a}if(o!==n){o!==0&&(i=i.slice(o)),s=e(s,n,n=o+i.length*3,1)>>>0;let a=ll().subarray(s+o,s+n),l=cl.encodeInto(i,a);o+=l.written,s=e(s,n,o,1)>>>0}return Ho=o,s}function jd(i){let t=Ae.__wbindgen_externrefs.get(i);return Ae.__externref_table_dealloc(i),t}var Oh=new TextDecoder("utf-8",{ignoreBOM:!0});Oh.decode();var ZM=2146435072,Qd=0;function JM(i){return Qd+=i.length,Qd>=ZM&&(Oh=new TextDecoder("utf-8",{ignoreBOM:!0}),Oh.decode(),Qd=i.length),Oh.decode(i)}var cl=new TextEncoder;"encodeInto"in cl||(cl.encodeInto=function(i,t){let e=cl.encode(i);return t.set(e),{read:i.length,written:e.length}});var Ho=0,jM,QM,Ae;function Rg(i,t){return QM=i,Ae=i.exports,jM=t,rl=null,ol=null,al=null,Ae.__wbindgen_start(),Ae}async function tw(i,t){if(typeof Response=="function"&&i instanceof Response){if(!i.ok)throw new Error(`failed to fetch Wasm: ${i.status} ${i.statusText} fetching '${i.url}'`);if(typeof WebAssembly.instantiateStreaming=="function")try{return await WebAssembly.instantiateStreaming(i,t)}catch(s){if(e(i.type)&&i.headers.get("Content-Type")!=="application/wasm")console.warn("`WebAssembly.instantiateStreaming` failed because your server does not serve Wasm with `application/wasm` MIME type. Falling back to `WebAssembly.instantiate` which is slower. Original error:\n",s);else throw s}let n=await i.arrayBuffer();return await WebAssembly.instantiate(n,t)}else{let n=await WebAssembly.instantiate(i,t);return n instanceof WebAssembly.Instance?{instance:n,module:i}:n}function e(n){switch(n){case"basic":case"cors":case"default":return!0}return!1}}function tf(i){if(Ae!==void 0)return Ae;i!==void 0&&(Object.getPrototypeOf(i)===Object.prototype?{module:i}=i:console.warn("using deprecated parameters for `initSync()`; pass a single object instead"));let t=Eg();i instanceof WebAssembly.Module||(i=new WebAssembly.Module(i));let e=new WebAssembly.Instance(i,t);return Rg(e,i)}var sl;async function ew(i){return Ae!==void 0?Ae:(sl===void 0&&(sl=nw(i),sl.catch(()=>{sl=void 0})),sl)}async function nw(i){i!==void 0&&(Object.getPrototypeOf(i)===Object.prototype?{module_or_path:i}=i:console.warn("using deprecated parameters for the initialization function; pass a single object instead"));let t=Eg();(typeof i=="string"||typeof Request=="function"&&i instanceof Request||typeof URL=="function"&&i instanceof URL)&&(i=fetch(i));let{instance:e,module:n}=await tw(await i,t);return Rg(e,n)}async function Ig(){let i=atob(document.getElementById("module").textContent),t=Uint8Array.from(i,n=>n.charCodeAt(0)),e=new Blob([t]).stream().pipeThrough(new DecompressionStream("gzip"));tf({module:await new Response(e).arrayBuffer()})}var iw=["440154","481a6c","472f7d","414487","39568c","31688e","2a788e","23888e","1f988b","22a884","35b779","54c568","7ad151","a5db36","d2e21b","fde725"],sw=["00224e","002d6c","16396d","30466b","434e6c","535a6e","61666f","707173","7f7c75","8f8977","a09676","b1a372","c3b16c","d6bf61","e9ce52","fee838"],rw=["0b4f8a","2f77b4","66a3d2","a3c8e2","c9cdd2","f0c08c","ea9a4a","d6721f","a64b00"],Fh=i=>[0,2,4].map(t=>parseInt(i.slice(t,t+2),16));function ef(i){let t=i.map(Fh),e=new Uint8ClampedArray(256*3);for(let n=0;n<256;n++){let s=n/255*(t.length-1),r=Math.min(t.length-2,Math.floor(s));for(let o=0;o<3;o++)e[3*n+o]=t[r][o]+(s-r)*(t[r+1][o]-t[r][o])}return e}var Xo={viridis:ef(iw),cividis:ef(sw),diverging:ef(rw)};function sf(i,t){let e=3*Math.round(255*Math.min(1,Math.max(0,t)));return[i[e],i[e+1],i[e+2]]}var ul=["0072B2","E69F00","009E73","CC79A7","56B4E9","D55E00","F0E442"].map(Fh),Pg={car:1,van:1,truck:5,bus:5,motorcycle:6,cyclist:3,pedestrian:3,child:3,guard_rail:0,post:4,marker:2,wall:4,noise:6,weather:6};function qi(i){let t=String(i).split(".")[0];if(t in Pg)return ul[Pg[t]];let e=7;for(let n of t)e=31*e+n.charCodeAt(0)>>>0;return t?ul[e%ul.length]:[140,140,140]}var ai=i=>`rgb(${ul[i%ul.length].join(",")})`,nf={asphalt:"4a4d52",concrete:"9a9a94","concrete-pavement":"b0aca0",gravel:"8a8172",soil:"6f6250","arable-land":"7d5b3a",grass:"5d7a4a",meadow:"7a9a55",leaves:"5d7a4a",water:"3f6f8f",ice:"bfe3f0",glass:"7fb2c9",rubber:"2b2b2e",steel:"a3adb8","stainless-steel":"8d9db0","galvanised-steel":"93a69d",aluminium:"c3cad1",copper:"b87333",pec:"b9c1ca","paint-white":"f2f2ee",iron:"8f959c",polypropylene:"d07fae",pmma:"57b8ae",wood:"b07f45",skin:"e0a98a",air:"dfe7ee"};function ow(i){let t=Object.keys(nf).filter(e=>i.includes(e)).sort((e,n)=>n.length-e.length);return t.length?Fh(nf[t[0]]):null}function Pr(i,t){if(["verge","terrain","ground"].includes(t))return Fh(nf.grass);let[e,...n]=String(i).toLowerCase().split("+").map(l=>l.split(":")[0]),s=l=>l.map(c=>Math.round(.6*c+70)),r=l=>ow(l)??s(qi(l?`material ${l}`:t)),o=r(e),a=n.length?r(n.at(-1)):o;return o.map((l,c)=>Math.round(.5*(l+a[c])))}var aw="uplot",lw="u-hz",cw="u-vt",hw="u-title",uw="u-wrap",dw="u-under",fw="u-over",pw="u-axis",Nr="u-off",mw="u-select",gw="u-cursor-x",_w="u-cursor-y",xw="u-cursor-pt",yw="u-legend",vw="u-live",Sw="u-inline",bw="u-series",Mw="u-marker",Lg="u-label",ww="u-value",fl="width",pl="height";var Dg="bottom",qo="left",rf="right",bf="#000",Ng=bf+"0",of="mousemove",Ug="mousedown",af="mouseup",Og="mouseenter",Fg="mouseleave",Bg="dblclick",Tw="resize",Aw="scroll",kg="change",Gh="dppxchange",Mf="--",Qo=typeof window<"u",df=Qo?document:null,$o=Qo?window:null,Ew=Qo?navigator:null,Ee,Bh;function ff(){let i=devicePixelRatio;Ee!=i&&(Ee=i,Bh&&mf(kg,Bh,ff),Bh=matchMedia(`(min-resolution: ${Ee-.001}dppx) and (max-resolution: ${Ee+.001}dppx)`),Ur(kg,Bh,ff),$o.dispatchEvent(new CustomEvent(Gh)))}function Si(i,t){if(t!=null){let e=i.classList;!e.contains(t)&&e.add(t)}}function pf(i,t){let e=i.classList;e.contains(t)&&e.remove(t)}function Ye(i,t,e){i.style[t]=e+"px"}function Yi(i,t,e,n){let s=df.createElement(i);return t!=null&&Si(s,t),e?.insertBefore(s,n),s}function Ii(i,t){return Yi("div",i,t)}var zg=new WeakMap;function fs(i,t,e,n,s){let r="translate("+t+"px,"+e+"px)",o=zg.get(i);r!=o&&(i.style.transform=r,zg.set(i,r),t<0||e<0||t>n||e>s?Si(i,Nr):pf(i,Nr))}var Vg=new WeakMap;function Gg(i,t,e){let n=t+e,s=Vg.get(i);n!=s&&(Vg.set(i,n),i.style.background=t,i.style.borderColor=e)}var Hg=new WeakMap;function Wg(i,t,e,n){let s=t+""+e,r=Hg.get(i);s!=r&&(Hg.set(i,s),i.style.height=e+"px",i.style.width=t+"px",i.style.marginLeft=n?-t/2+"px":0,i.style.marginTop=n?-e/2+"px":0)}var wf={passive:!0},Cw={...wf,capture:!0};function Ur(i,t,e,n){t.addEventListener(i,e,n?Cw:wf)}function mf(i,t,e,n){t.removeEventListener(i,e,wf)}Qo&&ff();function $i(i,t,e,n){let s;e=e||0,n=n||t.length-1;let r=n<=2147483647;for(;n-e>1;)s=r?e+n>>1:bi((e+n)/2),t[s]<i?e=s:n=s;return i-t[e]<=t[n]-i?e:n}function x0(i){return(e,n,s)=>{let r=-1,o=-1;for(let a=n;a<=s;a++)if(i(e[a])){r=a;break}for(let a=s;a>=n;a--)if(i(e[a])){o=a;break}return[r,o]}}var y0=i=>i!=null,v0=i=>i!=null&&i>0,Xh=x0(y0),Rw=x0(v0);function Iw(i,t,e,n=0,s=!1){let r=s?Rw:Xh,o=s?v0:y0;[t,e]=r(i,t,e);let a=i[t],l=i[t];if(t>-1)if(n==1)a=i[t],l=i[e];else if(n==-1)a=i[e],l=i[t];else for(let c=t;c<=e;c++){let u=i[c];o(u)&&(u<a?a=u:u>l&&(l=u))}return[a??ke,l??-ke]}function qh(i,t,e,n){let s=Yg(i),r=Yg(t);i==t&&(s==-1?(i*=e,t/=e):(i/=e,t*=e));let o=e==10?Bs:S0,a=s==1?bi:Pi,l=r==1?Pi:bi,c=a(o(Tn(i))),u=l(o(Tn(t))),h=Ko(e,c),d=Ko(e,u);return e==10&&(c<0&&(h=ze(h,-c)),u<0&&(d=ze(d,-u))),n||e==2?(i=h*s,t=d*r):(i=T0(i,h),t=Yh(t,d)),[i,t]}function Tf(i,t,e,n){let s=qh(i,t,e,n);return i==0&&(s[0]=0),t==0&&(s[1]=0),s}var Af=.1,Xg={mode:3,pad:Af},gl={pad:0,soft:null,mode:0},Pw={min:gl,max:gl};function Hh(i,t,e,n){return $h(e)?qg(i,t,e):(gl.pad=e,gl.soft=n?0:null,gl.mode=n?3:0,qg(i,t,Pw))}function we(i,t){return i??t}function Lw(i,t,e){for(t=we(t,0),e=we(e,i.length-1);t<=e;){if(i[t]!=null)return!0;t++}return!1}function qg(i,t,e){let n=e.min,s=e.max,r=we(n.pad,0),o=we(s.pad,0),a=we(n.hard,-ke),l=we(s.hard,ke),c=we(n.soft,ke),u=we(s.soft,-ke),h=we(n.mode,0),d=we(s.mode,0),f=t-i,m=Bs(f),y=si(Tn(i),Tn(t)),p=Bs(y),g=Tn(p-m);(f<1e-24||g>10)&&(f=0,(i==0||t==0)&&(f=1e-24,h==2&&c!=ke&&(r=0),d==2&&u!=-ke&&(o=0)));let v=f||y||1e3,E=Bs(v),b=Ko(10,bi(E)),I=v*(f==0?i==0?.1:1:r),A=ze(T0(i-I,b/10),24),x=i>=c&&(h==1||h==3&&A<=c||h==2&&A>=c)?c:ke,T=si(a,A<x&&i>=x?x:Ki(x,A)),V=v*(f==0?t==0?.1:1:o),N=ze(Yh(t+V,b/10),24),L=t<=u&&(d==1||d==3&&N>=u||d==2&&N<=u)?u:-ke,X=Ki(l,N>L&&t<=L?L:si(L,N));return T==X&&T==0&&(X=100),[T,X]}var Dw=new Intl.NumberFormat(Qo?Ew.language:"en-US"),Ef=i=>Dw.format(i),Mi=Math,Vh=Mi.PI,Tn=Mi.abs,bi=Mi.floor,wn=Mi.round,Pi=Mi.ceil,Ki=Mi.min,si=Mi.max,Ko=Mi.pow,Yg=Mi.sign,Bs=Mi.log10,S0=Mi.log2,Nw=(i,t=1)=>Mi.sinh(i)*t,lf=(i,t=1)=>Mi.asinh(i/t),ke=1/0;function $g(i){return(Bs((i^i>>31)-(i>>31))|0)+1}function gf(i,t,e){return Ki(si(i,t),e)}function b0(i){return typeof i=="function"}function ve(i){return b0(i)?i:()=>i}var Uw=()=>{},M0=i=>i,w0=(i,t)=>t,Ow=i=>null,Kg=i=>!0,Zg=(i,t)=>i==t,Fw=/\.\d*?(?=9{6,}|0{6,})/gm,Or=i=>{if(E0(i)||dr.has(i))return i;let t=`${i}`,e=t.match(Fw);if(e==null)return i;let n=e[0].length-1;if(t.indexOf("e-")!=-1){let[s,r]=t.split("e");return+`${Or(s)}e${r}`}return ze(i,n)};function Lr(i,t){return Or(ze(Or(i/t))*t)}function Yh(i,t){return Or(Pi(Or(i/t))*t)}function T0(i,t){return Or(bi(Or(i/t))*t)}function ze(i,t=0){if(E0(i))return i;let e=10**t,n=i*e*(1+Number.EPSILON);return wn(n)/e}var dr=new Map;function A0(i){return((""+i).split(".")[1]||"").length}function xl(i,t,e,n){let s=[],r=n.map(A0);for(let o=t;o<e;o++){let a=Tn(o),l=ze(Ko(i,o),a);for(let c=0;c<n.length;c++){let u=i==10?+`${n[c]}e${o}`:n[c]*l,h=(o>=0?0:a)+(o>=r[c]?0:r[c]),d=i==10?u:ze(u,h);s.push(d),dr.set(d,h)}}return s}var _l={},Cf=[],Zo=[null,null],ur=Array.isArray,E0=Number.isInteger,Bw=i=>i===void 0;function Jg(i){return typeof i=="string"}function $h(i){let t=!1;if(i!=null){let e=i.constructor;t=e==null||e==Object}return t}function kw(i){return i!=null&&typeof i=="object"}var zw=Object.getPrototypeOf(Uint8Array),C0="__proto__";function Jo(i,t=$h){let e;if(ur(i)){let n=i.find(s=>s!=null);if(ur(n)||t(n)){e=Array(i.length);for(let s=0;s<i.length;s++)e[s]=Jo(i[s],t)}else e=i.slice()}else if(i instanceof zw)e=i.slice();else if(t(i)){e={};for(let n in i)n!=C0&&(e[n]=Jo(i[n],t))}else e=i;return e}function _n(i){let t=arguments;for(let e=1;e<t.length;e++){let n=t[e];for(let s in n)s!=C0&&($h(i[s])?_n(i[s],Jo(n[s])):i[s]=Jo(n[s]))}return i}var Vw=0,Gw=1,Hw=2;function Ww(i,t,e){for(let n=0,s,r=-1;n<t.length;n++){let o=t[n];if(o>r){for(s=o-1;s>=0&&i[s]==null;)i[s--]=null;for(s=o+1;s<e&&i[s]==null;)i[r=s++]=null}}}function Xw(i,t){if($w(i)){let o=i[0].slice();for(let a=1;a<i.length;a++)o.push(...i[a].slice(1));return Kw(o[0])||(o=Yw(o)),o}let e=new Set;for(let o=0;o<i.length;o++){let l=i[o][0],c=l.length;for(let u=0;u<c;u++)e.add(l[u])}let n=[Array.from(e).sort((o,a)=>o-a)],s=n[0].length,r=new Map;for(let o=0;o<s;o++)r.set(n[0][o],o);for(let o=0;o<i.length;o++){let a=i[o],l=a[0];for(let c=1;c<a.length;c++){let u=a[c],h=Array(s).fill(void 0),d=t?t[o][c]:Gw,f=[];for(let m=0;m<u.length;m++){let y=u[m],p=r.get(l[m]);y===null?d!=Vw&&(h[p]=y,d==Hw&&f.push(p)):h[p]=y}Ww(h,f,s),n.push(h)}}return n}var qw=typeof queueMicrotask>"u"?i=>Promise.resolve().then(i):queueMicrotask;function Yw(i){let t=i[0],e=t.length,n=Array(e);for(let r=0;r<n.length;r++)n[r]=r;n.sort((r,o)=>t[r]-t[o]);let s=[];for(let r=0;r<i.length;r++){let o=i[r],a=Array(e);for(let l=0;l<e;l++)a[l]=o[n[l]];s.push(a)}return s}function $w(i){let t=i[0][0],e=t.length;for(let n=1;n<i.length;n++){let s=i[n][0];if(s.length!=e)return!1;if(s!=t){for(let r=0;r<e;r++)if(s[r]!=t[r])return!1}}return!0}function Kw(i,t=100){let e=i.length;if(e<=1)return!0;let n=0,s=e-1;for(;n<=s&&i[n]==null;)n++;for(;s>=n&&i[s]==null;)s--;if(s<=n)return!0;let r=si(1,bi((s-n+1)/t));for(let o=i[n],a=n+r;a<=s;a+=r){let l=i[a];if(l!=null){if(l<=o)return!1;o=l}}return!0}var R0=["January","February","March","April","May","June","July","August","September","October","November","December"],I0=["Sunday","Monday","Tuesday","Wednesday","Thursday","Friday","Saturday"];function P0(i){return i.slice(0,3)}var Zw=I0.map(P0),Jw=R0.map(P0),jw={MMMM:R0,MMM:Jw,WWWW:I0,WWW:Zw};function dl(i){return(i<10?"0":"")+i}function Qw(i){return(i<10?"00":i<100?"0":"")+i}var tT={YYYY:i=>i.getFullYear(),YY:i=>(i.getFullYear()+"").slice(2),MMMM:(i,t)=>t.MMMM[i.getMonth()],MMM:(i,t)=>t.MMM[i.getMonth()],MM:i=>dl(i.getMonth()+1),M:i=>i.getMonth()+1,DD:i=>dl(i.getDate()),D:i=>i.getDate(),WWWW:(i,t)=>t.WWWW[i.getDay()],WWW:(i,t)=>t.WWW[i.getDay()],HH:i=>dl(i.getHours()),H:i=>i.getHours(),h:i=>{let t=i.getHours();return t==0?12:t>12?t-12:t},AA:i=>i.getHours()>=12?"PM":"AM",aa:i=>i.getHours()>=12?"pm":"am",a:i=>i.getHours()>=12?"p":"a",mm:i=>dl(i.getMinutes()),m:i=>i.getMinutes(),ss:i=>dl(i.getSeconds()),s:i=>i.getSeconds(),fff:i=>Qw(i.getMilliseconds())};function Rf(i,t){t=t||jw;let e=[],n=/\{([a-z]+)\}|[^{]+/gi,s;for(;s=n.exec(i);)e.push(s[0][0]=="{"?tT[s[1]]:s[0]);return r=>{let o="";for(let a=0;a<e.length;a++)o+=typeof e[a]=="string"?e[a]:e[a](r,t);return o}}var eT=new Intl.DateTimeFormat().resolvedOptions().timeZone;function nT(i,t){let e;return t=="UTC"||t=="Etc/UTC"?e=new Date(+i+i.getTimezoneOffset()*6e4):t==eT?e=i:(e=new Date(i.toLocaleString("en-US",{timeZone:t})),e.setMilliseconds(i.getMilliseconds())),e}var L0=i=>i%1==0,Wh=[1,2,2.5,5],iT=xl(10,-32,0,Wh),D0=xl(10,0,32,Wh),sT=D0.filter(L0),Dr=iT.concat(D0),If=`
`,N0="{YYYY}",jg=If+N0,U0="{M}/{D}",ml=If+U0,kh=ml+"/{YY}",O0="{aa}",rT="{h}:{mm}",Yo=rT+O0,Qg=If+Yo,t0=":{ss}",Pe=null;function F0(i){let t=i*1e3,e=t*60,n=e*60,s=n*24,r=s*30,o=s*365,l=(i==1?xl(10,0,3,Wh).filter(L0):xl(10,-3,0,Wh)).concat([t,t*5,t*10,t*15,t*30,e,e*5,e*10,e*15,e*30,n,n*2,n*3,n*4,n*6,n*8,n*12,s,s*2,s*3,s*4,s*5,s*6,s*7,s*8,s*9,s*10,s*15,r,r*2,r*3,r*4,r*6,o,o*2,o*5,o*10,o*25,o*50,o*100]),c=[[o,N0,Pe,Pe,Pe,Pe,Pe,Pe,1],[s*28,"{MMM}",jg,Pe,Pe,Pe,Pe,Pe,1],[s,U0,jg,Pe,Pe,Pe,Pe,Pe,1],[n,"{h}"+O0,kh,Pe,ml,Pe,Pe,Pe,1],[e,Yo,kh,Pe,ml,Pe,Pe,Pe,1],[t,t0,kh+" "+Yo,Pe,ml+" "+Yo,Pe,Qg,Pe,1],[i,t0+".{fff}",kh+" "+Yo,Pe,ml+" "+Yo,Pe,Qg,Pe,1]];function u(h){return(d,f,m,y,p,g)=>{let v=[],E=p>=o,b=p>=r&&p<o,I=h(m),A=ze(I*i,3),x=cf(I.getFullYear(),E?0:I.getMonth(),b||E?1:I.getDate()),T=ze(x*i,3);if(b||E){let V=b?p/r:0,N=E?p/o:0,L=A==T?A:ze(cf(x.getFullYear()+N,x.getMonth()+V,1)*i,3),X=new Date(wn(L/i)),q=X.getFullYear(),D=X.getMonth();for(let W=0;L<=y;W++){let J=cf(q+N*W,D+V*W,1),H=J-h(ze(J*i,3));L=ze((+J+H)*i,3),L<=y&&v.push(L)}}else{let V=p>=s?s:p,N=bi(m)-bi(A),L=T+N+Yh(A-T,V);v.push(L);let X=h(L),q=X.getHours()+X.getMinutes()/e+X.getSeconds()/n,D=p/n,W=d.axes[f]._space,J=g/W;for(;L=ze(L+p,i==1?0:3),!(L>y);)if(D>1){let H=bi(ze(q+D,6))%24,tt=h(L).getHours()-H;tt>1&&(tt=-1),L-=tt*n,q=(q+D)%24;let rt=v[v.length-1];ze((L-rt)/p,3)*J>=.7&&v.push(L)}else v.push(L)}return v}}return[l,c,u]}var[oT,aT,lT]=F0(1),[cT,hT,uT]=F0(.001);xl(2,-53,53,[1]);function e0(i,t){return i.map(e=>e.map((n,s)=>s==0||s==8||n==null?n:t(s==1||e[8]==0?n:e[1]+n)))}function n0(i,t){return(e,n,s,r,o)=>{let a=t.find(m=>o>=m[0])||t[t.length-1],l,c,u,h,d,f;return n.map(m=>{let y=i(m),p=y.getFullYear(),g=y.getMonth(),v=y.getDate(),E=y.getHours(),b=y.getMinutes(),I=y.getSeconds(),A=p!=l&&a[2]||g!=c&&a[3]||v!=u&&a[4]||E!=h&&a[5]||b!=d&&a[6]||I!=f&&a[7]||a[1];return l=p,c=g,u=v,h=E,d=b,f=I,A(y)})}}function dT(i,t){let e=Rf(t);return(n,s,r,o,a)=>s.map(l=>e(i(l)))}function cf(i,t,e){return new Date(i,t,e)}function i0(i,t){return t(i)}var fT="{YYYY}-{MM}-{DD} {h}:{mm}{aa}";function s0(i,t){return(e,n,s,r)=>r==null?Mf:t(i(n))}function pT(i,t){let e=i.series[t];return e.width?e.stroke(i,t):e.points.width?e.points.stroke(i,t):null}function mT(i,t){return i.series[t].fill(i,t)}var gT={show:!0,live:!0,isolate:!1,mount:Uw,markers:{show:!0,width:2,stroke:pT,fill:mT,dash:"solid"},idx:null,idxs:null,values:[]};function _T(i,t){let e=i.cursor.points,n=Ii(),s=e.size(i,t);Ye(n,fl,s),Ye(n,pl,s);let r=s/-2;Ye(n,"marginLeft",r),Ye(n,"marginTop",r);let o=e.width(i,t,s);return o&&Ye(n,"borderWidth",o),n}function xT(i,t){let e=i.series[t].points;return e._fill||e._stroke}function yT(i,t){let e=i.series[t].points;return e._stroke||e._fill}function vT(i,t){return i.series[t].points.size}var hf=[0,0];function ST(i,t,e){return hf[0]=t,hf[1]=e,hf}function zh(i,t,e,n=!0){return s=>{s.button==0&&(!n||s.target==t)&&e(s)}}function uf(i,t,e,n=!0){return s=>{(!n||s.target==t)&&e(s)}}var bT={show:!0,x:!0,y:!0,lock:!1,move:ST,points:{one:!1,show:_T,size:vT,width:0,stroke:yT,fill:xT},bind:{mousedown:zh,mouseup:zh,click:zh,dblclick:zh,mousemove:uf,mouseleave:uf,mouseenter:uf},drag:{setScale:!0,x:!0,y:!1,dist:0,uni:null,click:(i,t)=>{t.stopPropagation(),t.stopImmediatePropagation()},_x:!1,_y:!1},focus:{dist:(i,t,e,n,s)=>n-s,prox:-1,bias:0},hover:{skip:[void 0],prox:null,bias:0},left:-10,top:-10,idx:null,dataIdx:null,idxs:null,event:null},B0={show:!0,stroke:"rgba(0,0,0,0.07)",width:2},Pf=_n({},B0,{filter:w0}),k0=_n({},Pf,{size:10}),z0=_n({},B0,{show:!1}),Lf='12px system-ui, -apple-system, "Segoe UI", Roboto, "Helvetica Neue", Arial, "Noto Sans", sans-serif, "Apple Color Emoji", "Segoe UI Emoji", "Segoe UI Symbol", "Noto Color Emoji"',V0="bold "+Lf,G0=1.5,r0={show:!0,scale:"x",stroke:bf,space:50,gap:5,alignTo:1,size:50,labelGap:0,labelSize:30,labelFont:V0,side:2,grid:Pf,ticks:k0,border:z0,font:Lf,lineGap:G0,rotate:0},MT="Value",wT="Time",o0={show:!0,scale:"x",auto:!1,sorted:1,min:ke,max:-ke,idxs:[]};function TT(i,t,e,n,s){return t.map(r=>r==null?"":Ef(r))}function AT(i,t,e,n,s,r,o){let a=[],l=dr.get(s)||0;e=o?e:ze(Yh(e,s),l);for(let c=e;c<=n;c=ze(c+s,l))a.push(Object.is(c,-0)?0:c);return a}function _f(i,t,e,n,s,r,o){let a=[],l=i.scales[i.axes[t].scale].log,c=l==10?Bs:S0,u=bi(c(e));s=Ko(l,u),l==10&&(s=Dr[$i(s,Dr)]);let h=e,d=s*l;l==10&&(d=Dr[$i(d,Dr)]);do a.push(h),h=h+s,l==10&&!dr.has(h)&&(h=ze(h,dr.get(s))),h>=d&&(s=h,d=s*l,l==10&&(d=Dr[$i(d,Dr)]));while(h<=n);return a}function ET(i,t,e,n,s,r,o){let l=i.scales[i.axes[t].scale].asinh,c=n>l?_f(i,t,si(l,e),n,s):[l],u=n>=0&&e<=0?[0]:[];return(e<-l?_f(i,t,si(l,-n),-e,s):[l]).reverse().map(d=>-d).concat(u,c)}var H0=/./,CT=/[12357]/,RT=/[125]/,a0=/1/,xf=(i,t,e,n)=>i.map((s,r)=>t==4&&s==0||r%n==0&&e.test(s.toExponential()[s<0?1:0])?s:null);function IT(i,t,e,n,s){let r=i.axes[e],o=r.scale,a=i.scales[o],l=i.valToPos,c=r._space,u=l(10,o),h=l(9,o)-u>=c?H0:l(7,o)-u>=c?CT:l(5,o)-u>=c?RT:a0;if(h==a0){let d=Tn(l(1,o)-u);if(d<c)return xf(t.slice().reverse(),a.distr,h,Pi(c/d)).reverse()}return xf(t,a.distr,h,1)}function PT(i,t,e,n,s){let r=i.axes[e],o=r.scale,a=r._space,l=i.valToPos,c=Tn(l(1,o)-l(2,o));return c<a?xf(t.slice().reverse(),3,H0,Pi(a/c)).reverse():t}function LT(i,t,e,n){return n==null?Mf:t==null?"":Ef(t)}var l0={show:!0,scale:"y",stroke:bf,space:30,gap:5,alignTo:1,size:50,labelGap:0,labelSize:30,labelFont:V0,side:3,grid:Pf,ticks:k0,border:z0,font:Lf,lineGap:G0,rotate:0};function DT(i,t){let e=3+(i||1)*2;return ze(e*t,3)}function NT(i,t){let{scale:e,idxs:n}=i.series[0],s=i._data[0],r=i.valToPos(s[n[0]],e,!0),o=i.valToPos(s[n[1]],e,!0),a=Tn(o-r),l=i.series[t],c=a/(l.points.space*Ee);return n[1]-n[0]<=c}var c0={scale:null,auto:!0,sorted:0,min:ke,max:-ke},W0=(i,t,e,n,s)=>s,h0={show:!0,auto:!0,sorted:0,gaps:W0,alpha:1,facets:[_n({},c0,{scale:"x"}),_n({},c0,{scale:"y"})]},u0={scale:"y",auto:!0,sorted:0,show:!0,spanGaps:!1,gaps:W0,alpha:1,points:{show:NT,filter:null},values:null,min:ke,max:-ke,idxs:[],path:null,clip:null};function UT(i,t,e,n,s){return e/10}var X0={time:!0,auto:!0,distr:1,log:10,asinh:1,min:null,max:null,dir:1,ori:0},OT=_n({},X0,{time:!1,ori:1}),d0={};function q0(i,t){let e=d0[i];return e||(e={key:i,plots:[],sub(n){e.plots.push(n)},unsub(n){e.plots=e.plots.filter(s=>s!=n)},pub(n,s,r,o,a,l,c){for(let u=0;u<e.plots.length;u++)e.plots[u]!=s&&e.plots[u].pub(n,s,r,o,a,l,c)}},i!=null&&(d0[i]=e)),e}var jo=1,yf=2;function Fr(i,t,e){let n=i.mode,s=i.series[t],r=n==2?i._data[t]:i._data,o=i.scales,a=i.bbox,l=r[0],c=n==2?r[1]:r[t],u=n==2?o[s.facets[0].scale]:o[i.series[0].scale],h=n==2?o[s.facets[1].scale]:o[s.scale],d=a.left,f=a.top,m=a.width,y=a.height,p=i.valToPosH,g=i.valToPosV;return u.ori==0?e(s,l,c,u,h,p,g,d,f,m,y,Zh,ta,jh,$0,Z0):e(s,l,c,u,h,g,p,f,d,y,m,Jh,ea,Uf,K0,J0)}function Df(i,t){let e=0,n=0,s=we(i.bands,Cf);for(let r=0;r<s.length;r++){let o=s[r];o.series[0]==t?e=o.dir:o.series[1]==t&&(o.dir==1?n|=1:n|=2)}return[e,n==1?-1:n==2?1:n==3?2:0]}function FT(i,t,e,n,s){let r=i.mode,o=i.series[t],a=r==2?o.facets[1].scale:o.scale,l=i.scales[a];return s==-1?l.min:s==1?l.max:l.distr==3?l.dir==1?l.min:l.max:0}function ks(i,t,e,n,s,r){return Fr(i,t,(o,a,l,c,u,h,d,f,m,y,p)=>{let g=o.pxRound,v=c.dir*(c.ori==0?1:-1),E=c.ori==0?ta:ea,b,I;v==1?(b=e,I=n):(b=n,I=e);let A=g(h(a[b],c,y,f)),x=g(d(l[b],u,p,m)),T=g(h(a[I],c,y,f)),V=g(d(r==1?u.max:u.min,u,p,m)),N=new Path2D(s);return E(N,T,V),E(N,A,V),E(N,A,x),N})}function Kh(i,t,e,n,s,r){let o=null;if(i.length>0){o=new Path2D;let a=t==0?jh:Uf,l=e;for(let h=0;h<i.length;h++){let d=i[h];if(d[1]>d[0]){let f=d[0]-l;f>0&&a(o,l,n,f,n+r),l=d[1]}}let c=e+s-l,u=10;c>0&&a(o,l,n-u/2,c,n+r+u)}return o}function BT(i,t,e){let n=i[i.length-1];n&&n[0]==t?n[1]=e:i.push([t,e])}function Nf(i,t,e,n,s,r,o){let a=[],l=i.length;for(let c=s==1?e:n;c>=e&&c<=n;c+=s)if(t[c]===null){let h=c,d=c;if(s==1)for(;++c<=n&&t[c]===null;)d=c;else for(;--c>=e&&t[c]===null;)d=c;let f=r(i[h]),m=d==h?f:r(i[d]),y=h-s;f=o<=0&&y>=0&&y<l?r(i[y]):f;let g=d+s;m=o>=0&&g>=0&&g<l?r(i[g]):m,m>=f&&a.push([f,m])}return a}function f0(i){return i==0?M0:i==1?wn:t=>Lr(t,i)}function Y0(i){let t=i==0?Zh:Jh,e=i==0?(s,r,o,a,l,c)=>{s.arcTo(r,o,a,l,c)}:(s,r,o,a,l,c)=>{s.arcTo(o,r,l,a,c)},n=i==0?(s,r,o,a,l)=>{s.rect(r,o,a,l)}:(s,r,o,a,l)=>{s.rect(o,r,l,a)};return(s,r,o,a,l,c=0,u=0)=>{c==0&&u==0?n(s,r,o,a,l):(c=Ki(c,a/2,l/2),u=Ki(u,a/2,l/2),t(s,r+c,o),e(s,r+a,o,r+a,o+l,c),e(s,r+a,o+l,r,o+l,u),e(s,r,o+l,r,o,u),e(s,r,o,r+a,o,c),s.closePath())}}var Zh=(i,t,e)=>{i.moveTo(t,e)},Jh=(i,t,e)=>{i.moveTo(e,t)},ta=(i,t,e)=>{i.lineTo(t,e)},ea=(i,t,e)=>{i.lineTo(e,t)},jh=Y0(0),Uf=Y0(1),$0=(i,t,e,n,s,r)=>{i.arc(t,e,n,s,r)},K0=(i,t,e,n,s,r)=>{i.arc(e,t,n,s,r)},Z0=(i,t,e,n,s,r,o)=>{i.bezierCurveTo(t,e,n,s,r,o)},J0=(i,t,e,n,s,r,o)=>{i.bezierCurveTo(e,t,s,n,o,r)};function j0(i){return(t,e,n,s,r)=>Fr(t,e,(o,a,l,c,u,h,d,f,m,y,p)=>{let{pxRound:g,points:v}=o,E,b;c.ori==0?(E=Zh,b=$0):(E=Jh,b=K0);let I=ze(v.width*Ee,3),A=(v.size-v.width)/2*Ee,x=ze(A*2,3),T=new Path2D,V=new Path2D,{left:N,top:L,width:X,height:q}=t.bbox;jh(V,N-x,L-x,X+x*2,q+x*2);let D=W=>{if(l[W]!=null){let J=g(h(a[W],c,y,f)),H=g(d(l[W],u,p,m));E(T,J+A,H),b(T,J,H,A,0,Vh*2)}};if(r)r.forEach(D);else for(let W=n;W<=s;W++)D(W);return{stroke:I>0?T:null,fill:T,clip:V,flags:jo|yf}})}function Q0(i){return(t,e,n,s,r,o)=>{n!=s&&(r!=n&&o!=n&&i(t,e,n),r!=s&&o!=s&&i(t,e,s),i(t,e,o))}}var kT=Q0(ta),zT=Q0(ea);function t_(i){let t=we(i?.alignGaps,0);return(e,n,s,r)=>Fr(e,n,(o,a,l,c,u,h,d,f,m,y,p)=>{[s,r]=Xh(l,s,r);let g=o.pxRound,v=q=>g(h(q,c,y,f)),E=q=>g(d(q,u,p,m)),b,I;c.ori==0?(b=ta,I=kT):(b=ea,I=zT);let A=c.dir*(c.ori==0?1:-1),x={stroke:new Path2D,fill:null,clip:null,band:null,gaps:null,flags:jo},T=x.stroke,V=!1;if(r-s>=y*4){let q=dt=>e.posToVal(dt,c.key,!0),D=null,W=null,J,H,ht,j=v(a[A==1?s:r]),tt=v(a[s]),rt=v(a[r]),ft=q(A==1?tt+1:rt-1);for(let dt=A==1?s:r;dt>=s&&dt<=r;dt+=A){let et=a[dt],yt=(A==1?et<ft:et>ft)?j:v(et),Ct=l[dt];yt==j?Ct!=null?(H=Ct,D==null?(b(T,yt,E(H)),J=D=W=H):H<D?D=H:H>W&&(W=H)):Ct===null&&(V=!0):(D!=null&&I(T,j,E(D),E(W),E(J),E(H)),Ct!=null?(H=Ct,b(T,yt,E(H)),D=W=J=H):(D=W=null,Ct===null&&(V=!0)),j=yt,ft=q(j+A))}D!=null&&D!=W&&ht!=j&&I(T,j,E(D),E(W),E(J),E(H))}else for(let q=A==1?s:r;q>=s&&q<=r;q+=A){let D=l[q];D===null?V=!0:D!=null&&b(T,v(a[q]),E(D))}let[L,X]=Df(e,n);if(o.fill!=null||L!=0){let q=x.fill=new Path2D(T),D=o.fillTo(e,n,o.min,o.max,L),W=E(D),J=v(a[s]),H=v(a[r]);A==-1&&([H,J]=[J,H]),b(q,H,W),b(q,J,W)}if(!o.spanGaps){let q=[];V&&q.push(...Nf(a,l,s,r,A,v,t)),x.gaps=q=o.gaps(e,n,s,r,q),x.clip=Kh(q,c.ori,f,m,y,p)}return X!=0&&(x.band=X==2?[ks(e,n,s,r,T,-1),ks(e,n,s,r,T,1)]:ks(e,n,s,r,T,X)),x})}function VT(i){let t=we(i.align,1),e=we(i.ascDesc,!1),n=we(i.alignGaps,0),s=we(i.extend,!1);return(r,o,a,l)=>Fr(r,o,(c,u,h,d,f,m,y,p,g,v,E)=>{[a,l]=Xh(h,a,l);let b=c.pxRound,{left:I,width:A}=r.bbox,x=tt=>b(m(tt,d,v,p)),T=tt=>b(y(tt,f,E,g)),V=d.ori==0?ta:ea,N={stroke:new Path2D,fill:null,clip:null,band:null,gaps:null,flags:jo},L=N.stroke,X=d.dir*(d.ori==0?1:-1),q=T(h[X==1?a:l]),D=x(u[X==1?a:l]),W=D,J=D;s&&t==-1&&(J=I,V(L,J,q)),V(L,D,q);for(let tt=X==1?a:l;tt>=a&&tt<=l;tt+=X){let rt=h[tt];if(rt==null)continue;let ft=x(u[tt]),dt=T(rt);t==1?V(L,ft,q):V(L,W,dt),V(L,ft,dt),q=dt,W=ft}let H=W;s&&t==1&&(H=I+A,V(L,H,q));let[ht,j]=Df(r,o);if(c.fill!=null||ht!=0){let tt=N.fill=new Path2D(L),rt=c.fillTo(r,o,c.min,c.max,ht),ft=T(rt);V(tt,H,ft),V(tt,J,ft)}if(!c.spanGaps){let tt=[];tt.push(...Nf(u,h,a,l,X,x,n));let rt=c.width*Ee/2,ft=e||t==1?rt:-rt,dt=e||t==-1?-rt:rt;tt.forEach(et=>{et[0]+=ft,et[1]+=dt}),N.gaps=tt=c.gaps(r,o,a,l,tt),N.clip=Kh(tt,d.ori,p,g,v,E)}return j!=0&&(N.band=j==2?[ks(r,o,a,l,L,-1),ks(r,o,a,l,L,1)]:ks(r,o,a,l,L,j)),N})}function p0(i,t,e,n,s,r,o=ke){if(i.length>1){let a=null;for(let l=0,c=1/0;l<i.length;l++)if(t[l]!==void 0){if(a!=null){let u=Tn(i[l]-i[a]);u<c&&(c=u,o=Tn(e(i[l],n,s,r)-e(i[a],n,s,r)))}a=l}}return o}function GT(i){i=i||_l;let t=we(i.size,[.6,ke,1]),e=i.align||0,n=i.gap||0,s=i.radius;s=s==null?[0,0]:typeof s=="number"?[s,0]:s;let r=ve(s),o=1-t[0],a=we(t[1],ke),l=we(t[2],1),c=we(i.disp,_l),u=we(i.each,f=>{}),{fill:h,stroke:d}=c;return(f,m,y,p)=>Fr(f,m,(g,v,E,b,I,A,x,T,V,N,L)=>{let X=g.pxRound,q=e,D=n*Ee,W=a*Ee,J=l*Ee,H,ht;b.ori==0?[H,ht]=r(f,m):[ht,H]=r(f,m);let j=b.dir*(b.ori==0?1:-1),tt=b.ori==0?jh:Uf,rt=b.ori==0?u:(It,Kt,ae,wt,Be,Gt,Yt)=>{u(It,Kt,ae,Be,wt,Yt,Gt)},ft=we(f.bands,Cf).find(It=>It.series[0]==m),dt=ft!=null?ft.dir:0,et=g.fillTo(f,m,g.min,g.max,dt),gt=X(x(et,I,L,V)),yt,Ct,Mt,Xt=N,oe=X(g.width*Ee),Ht=!1,pe=null,ue=null,se=null,$e=null;h!=null&&(oe==0||d!=null)&&(Ht=!0,pe=h.values(f,m,y,p),ue=new Map,new Set(pe).forEach(It=>{It!=null&&ue.set(It,new Path2D)}),oe>0&&(se=d.values(f,m,y,p),$e=new Map,new Set(se).forEach(It=>{It!=null&&$e.set(It,new Path2D)})));let{x0:Ve,size:an}=c;if(Ve!=null&&an!=null){q=1,v=Ve.values(f,m,y,p),Ve.unit==2&&(v=v.map(ae=>f.posToVal(T+ae*N,b.key,!0)));let It=an.values(f,m,y,p);an.unit==2?Ct=It[0]*N:Ct=A(It[0],b,N,T)-A(0,b,N,T),Xt=p0(v,E,A,b,N,T,Xt),Mt=Xt-Ct+D}else Xt=p0(v,E,A,b,N,T,Xt),Mt=Xt*o+D,Ct=Xt-Mt;Mt<1&&(Mt=0),oe>=Ct/2&&(oe=0),Mt<5&&(X=M0);let Ue=Mt>0,En=Xt-Mt-(Ue?oe:0);Ct=X(gf(En,J,W)),yt=(q==0?Ct/2:q==j?0:Ct)-q*j*((q==0?D/2:0)+(Ue?oe/2:0));let Se={stroke:null,fill:null,clip:null,band:null,gaps:null,flags:0},xn=Ht?null:new Path2D,je=null;if(ft!=null)je=f.data[ft.series[1]];else{let{y0:It,y1:Kt}=c;It!=null&&Kt!=null&&(E=Kt.values(f,m,y,p),je=It.values(f,m,y,p))}let ln=H*Ct,O=ht*Ct;for(let It=j==1?y:p;It>=y&&It<=p;It+=j){let Kt=E[It];if(Kt==null)continue;if(je!=null){let Y=je[It]??0;if(Kt-Y==0)continue;gt=x(Y,I,L,V)}let ae=b.distr!=2||c!=null?v[It]:It,wt=A(ae,b,N,T),Be=x(we(Kt,et),I,L,V),Gt=X(wt-yt),Yt=X(si(Be,gt)),C=X(Ki(Be,gt)),S=Yt-C;if(Kt!=null){let Y=Kt<0?O:ln,ut=Kt<0?ln:O;Ht?(oe>0&&se[It]!=null&&tt($e.get(se[It]),Gt,C+bi(oe/2),Ct,si(0,S-oe),Y,ut),pe[It]!=null&&tt(ue.get(pe[It]),Gt,C+bi(oe/2),Ct,si(0,S-oe),Y,ut)):tt(xn,Gt,C+bi(oe/2),Ct,si(0,S-oe),Y,ut),rt(f,m,It,Gt-oe/2,C,Ct+oe,S)}}return oe>0?Se.stroke=Ht?$e:xn:Ht||(Se._fill=g.width==0?g._fill:g._stroke??g._fill,Se.width=0),Se.fill=Ht?ue:xn,Se})}function HT(i,t){let e=we(t?.alignGaps,0);return(n,s,r,o)=>Fr(n,s,(a,l,c,u,h,d,f,m,y,p,g)=>{[r,o]=Xh(c,r,o);let v=a.pxRound,E=H=>v(d(H,u,p,m)),b=H=>v(f(H,h,g,y)),I,A,x;u.ori==0?(I=Zh,x=ta,A=Z0):(I=Jh,x=ea,A=J0);let T=u.dir*(u.ori==0?1:-1),V=E(l[T==1?r:o]),N=V,L=[],X=[];for(let H=T==1?r:o;H>=r&&H<=o;H+=T)if(c[H]!=null){let j=l[H],tt=E(j);L.push(N=tt),X.push(b(c[H]))}let q={stroke:i(L,X,I,x,A,v),fill:null,clip:null,band:null,gaps:null,flags:jo},D=q.stroke,[W,J]=Df(n,s);if(a.fill!=null||W!=0){let H=q.fill=new Path2D(D),ht=a.fillTo(n,s,a.min,a.max,W),j=b(ht);x(H,N,j),x(H,V,j)}if(!a.spanGaps){let H=[];H.push(...Nf(l,c,r,o,T,E,e)),q.gaps=H=a.gaps(n,s,r,o,H),q.clip=Kh(H,u.ori,m,y,p,g)}return J!=0&&(q.band=J==2?[ks(n,s,r,o,D,-1),ks(n,s,r,o,D,1)]:ks(n,s,r,o,D,J)),q})}function WT(i){return HT(XT,i)}function XT(i,t,e,n,s,r){let o=i.length;if(o<2)return null;let a=new Path2D;if(e(a,i[0],t[0]),o==2)n(a,i[1],t[1]);else{let l=Array(o),c=Array(o-1),u=Array(o-1),h=Array(o-1);for(let d=0;d<o-1;d++)u[d]=t[d+1]-t[d],h[d]=i[d+1]-i[d],c[d]=u[d]/h[d];l[0]=c[0];for(let d=1;d<o-1;d++)c[d]===0||c[d-1]===0||c[d-1]>0!=c[d]>0?l[d]=0:(l[d]=3*(h[d-1]+h[d])/((2*h[d]+h[d-1])/c[d-1]+(h[d]+2*h[d-1])/c[d]),isFinite(l[d])||(l[d]=0));l[o-1]=c[o-2];for(let d=0;d<o-1;d++)s(a,i[d]+h[d]/3,t[d]+l[d]*h[d]/3,i[d+1]-h[d]/3,t[d+1]-l[d+1]*h[d]/3,i[d+1],t[d+1])}return a}var vf=new Set;function m0(){for(let i of vf)i.syncRect(!0)}Qo&&(Ur(Tw,$o,m0),Ur(Aw,$o,m0,!0),Ur(Gh,$o,()=>{On.pxRatio=Ee}));var qT=t_(),YT=j0();function g0(i,t,e,n){return(n?[i[0],i[1]].concat(i.slice(2)):[i[0]].concat(i.slice(1))).map((r,o)=>Sf(r,o,t,e))}function $T(i,t){return i.map((e,n)=>n==0?{}:_n({},t,e))}function Sf(i,t,e,n){return _n({},t==0?e:n,i)}function e_(i,t,e){return t==null?Zo:[t,e]}var KT=e_;function ZT(i,t,e){return t==null?Zo:Hh(t,e,Af,!0)}function n_(i,t,e,n){return t==null?Zo:qh(t,e,i.scales[n].log,!1)}var JT=n_;function i_(i,t,e,n){return t==null?Zo:Tf(t,e,i.scales[n].log,!1)}var jT=i_;function QT(i,t,e,n,s){let r=si($g(i),$g(t)),o=t-i,a=$i(s/n*o,e);do{let l=e[a],c=n*l/o;if(c>=s&&r+(l<5?dr.get(l):0)<=17)return[l,c]}while(++a<e.length);return[0,0]}function _0(i){let t,e;return i=i.replace(/(\d+)px/,(n,s)=>(t=wn((e=+s)*Ee))+"px"),[i,t,e]}function tA(i){i.show&&[i.font,i.labelFont].forEach(t=>{let e=ze(t[2]*Ee,1);t[0]=t[0].replace(/[0-9.]+px/,e+"px"),t[1]=e})}function On(i,t,e){let n={mode:we(i.mode,1)},s=n.mode;function r(_,M,R,P){let G=M.valToPct(_);return P+R*(M.dir==-1?1-G:G)}function o(_,M,R,P){let G=M.valToPct(_);return P+R*(M.dir==-1?G:1-G)}function a(_,M,R,P){return M.ori==0?r(_,M,R,P):o(_,M,R,P)}n.valToPosH=r,n.valToPosV=o;let l=!1;n.status=0;let c=n.root=Ii(aw);if(i.id!=null&&(c.id=i.id),Si(c,i.class),i.title){let _=Ii(hw,c);_.textContent=i.title}let u=Yi("canvas"),h=n.ctx=u.getContext("2d"),d=Ii(uw,c);Ur("click",d,_=>{_.target===m&&(He!=Zr||Ke!=Jr)&&Nn.click(n,_)},!0);let f=n.under=Ii(dw,d);d.appendChild(u);let m=n.over=Ii(fw,d);i=Jo(i);let y=+we(i.pxAlign,1),p=f0(y);(i.plugins||[]).forEach(_=>{_.opts&&(i=_.opts(n,i)||i)});let g=i.ms||.001,v=n.series=s==1?g0(i.series||[],o0,u0,!1):$T(i.series||[null],h0),E=n.axes=g0(i.axes||[],r0,l0,!0),b=n.scales={},I=n.bands=i.bands||[];I.forEach(_=>{_.fill=ve(_.fill||null),_.dir=we(_.dir,-1)});let A=s==2?v[1].facets[0].scale:v[0].scale,x={axes:vs,series:ge},T=(i.drawOrder||["axes","series"]).map(_=>x[_]);function V(_){let M=_.distr==3?R=>Bs(R>0?R:_.clamp(n,R,_.min,_.max,_.key)):_.distr==4?R=>lf(R,_.asinh):_.distr==100?R=>_.fwd(R):R=>R;return R=>{let P=M(R),{_min:G,_max:Z}=_,lt=Z-G;return(P-G)/lt}}function N(_){let M=b[_];if(M==null){let R=(i.scales||_l)[_]||_l;if(R.from!=null){N(R.from);let P=_n({},b[R.from],R,{key:_});P.valToPct=V(P),b[_]=P}else{M=b[_]=_n({},_==A?X0:OT,R),M.key=_;let P=M.time,G=M.range,Z=ur(G);if((_!=A||s==2&&!P)&&(Z&&(G[0]==null||G[1]==null)&&(G={min:G[0]==null?Xg:{mode:1,hard:G[0],soft:G[0]},max:G[1]==null?Xg:{mode:1,hard:G[1],soft:G[1]}},Z=!1),!Z&&$h(G))){let lt=G;G=(pt,St,Nt)=>St==null?Zo:Hh(St,Nt,lt)}M.range=ve(G||(P?KT:_==A?M.distr==3?JT:M.distr==4?jT:e_:M.distr==3?n_:M.distr==4?i_:ZT)),M.auto=ve(Z?!1:M.auto),M.clamp=ve(M.clamp||UT),M._min=M._max=null,M.valToPct=V(M)}}}N("x"),N("y"),s==1&&v.forEach(_=>{N(_.scale)}),E.forEach(_=>{N(_.scale)});for(let _ in i.scales)N(_);let L=b[A],X=L.distr,q,D;L.ori==0?(Si(c,lw),q=r,D=o):(Si(c,cw),q=o,D=r);let W={};for(let _ in b){let M=b[_];(M.min!=null||M.max!=null)&&(W[_]={min:M.min,max:M.max},M.min=M.max=null)}let J=i.tzDate||(_=>new Date(wn(_/g))),H=i.fmtDate||Rf,ht=g==1?lT(J):uT(J),j=n0(J,e0(g==1?aT:hT,H)),tt=s0(J,i0(fT,H)),rt=[],ft=n.legend=_n({},gT,i.legend),dt=n.cursor=_n({},bT,{drag:{y:s==2}},i.cursor),et=ft.show,gt=dt.show,yt=ft.markers;ft.idxs=rt,yt.width=ve(yt.width),yt.dash=ve(yt.dash),yt.stroke=ve(yt.stroke),yt.fill=ve(yt.fill);let Ct,Mt,Xt,oe=[],Ht=[],pe,ue=!1,se={};if(ft.live){let _=v[1]?v[1].values:null;ue=_!=null,pe=ue?_(n,1,0):{_:0};for(let M in pe)se[M]=Mf}if(et)if(Ct=Yi("table",yw,c),Xt=Yi("tbody",null,Ct),ft.mount(n,Ct),ue){Mt=Yi("thead",null,Ct,Xt);let _=Yi("tr",null,Mt);Yi("th",null,_);for(var $e in pe)Yi("th",Lg,_).textContent=$e}else Si(Ct,Sw),ft.live&&Si(Ct,vw);let Ve={show:!0},an={show:!1};function Ue(_,M){if(M==0&&(ue||!ft.live||s==2))return Zo;let R=[],P=Yi("tr",bw,Xt,Xt.childNodes[M]);Si(P,_.class),_.show||Si(P,Nr);let G=Yi("th",null,P);if(yt.show){let pt=Ii(Mw,G);if(M>0){let St=yt.width(n,M);St&&(pt.style.border=St+"px "+yt.dash(n,M)+" "+yt.stroke(n,M)),pt.style.background=yt.fill(n,M)}}let Z=Ii(Lg,G);_.label instanceof HTMLElement?Z.appendChild(_.label):Z.textContent=_.label,M>0&&(yt.show||(Z.style.color=_.width>0?yt.stroke(n,M):yt.fill(n,M)),Se("click",G,pt=>{if(dt._lock)return;Qt(pt);let St=v.indexOf(_);if((pt.ctrlKey||pt.metaKey)!=ft.isolate){let Nt=v.some((Ut,Bt)=>Bt>0&&Bt!=St&&Ut.show);v.forEach((Ut,Bt)=>{Bt>0&&ns(Bt,Nt?Bt==St?Ve:an:Ve,!0,dn.setSeries)})}else ns(St,{show:!_.show},!0,dn.setSeries)},!1),te&&Se(Og,G,pt=>{dt._lock||(Qt(pt),ns(v.indexOf(_),Qr,!0,dn.setSeries))},!1));for(var lt in pe){let pt=Yi("td",ww,P);pt.textContent="--",R.push(pt)}return[P,R]}let En=new Map;function Se(_,M,R,P=!0){let G=En.get(M)||{},Z=dt.bind[_](n,M,R,P);Z&&(Ur(_,M,G[_]=Z),En.set(M,G))}function xn(_,M,R){let P=En.get(M)||{};for(let G in P)(_==null||G==_)&&(mf(G,M,P[G]),delete P[G]);_==null&&En.delete(M)}let je=0,ln=0,O=0,It=0,Kt=0,ae=0,wt=Kt,Be=ae,Gt=O,Yt=It,C=0,S=0,Y=0,ut=0;n.bbox={};let at=!1,xt=!1,vt=!1,nt=!1,st=!1,mt=!1;function U(_,M,R){(R||_!=n.width||M!=n.height)&&ot(_,M),de(!1),vt=!0,xt=!0,zn()}function ot(_,M){n.width=je=O=_,n.height=ln=It=M,Kt=ae=0,bt(),Wt();let R=n.bbox;C=R.left=Lr(Kt*Ee,.5),S=R.top=Lr(ae*Ee,.5),Y=R.width=Lr(O*Ee,.5),ut=R.height=Lr(It*Ee,.5)}let it=3;function Tt(){let _=!1,M=0;for(;!_;){M++;let R=Yr(M),P=es(M);_=M==it||R&&P,_||(ot(n.width,n.height),xt=!0)}}function _t({width:_,height:M}){U(_,M)}n.setSize=_t;function bt(){let _=!1,M=!1,R=!1,P=!1;E.forEach((G,Z)=>{if(G.show&&G._show){let{side:lt,_size:pt}=G,St=lt%2,Nt=G.label!=null?G.labelSize:0,Ut=pt+Nt;Ut>0&&(St?(O-=Ut,lt==3?(Kt+=Ut,P=!0):R=!0):(It-=Ut,lt==0?(ae+=Ut,_=!0):M=!0))}}),Qi[0]=_,Qi[1]=R,Qi[2]=M,Qi[3]=P,O-=Di[1]+Di[3],Kt+=Di[3],It-=Di[2]+Di[0],ae+=Di[0]}function Wt(){let _=Kt+O,M=ae+It,R=Kt,P=ae;function G(Z,lt){switch(Z){case 1:return _+=lt,_-lt;case 2:return M+=lt,M-lt;case 3:return R-=lt,R+lt;case 0:return P-=lt,P+lt}}E.forEach((Z,lt)=>{if(Z.show&&Z._show){let pt=Z.side;Z._pos=G(pt,Z._size),Z.label!=null&&(Z._lpos=G(pt,Z.labelSize))}})}if(dt.dataIdx==null){let _=dt.hover,M=_.skip=new Set(_.skip??[]);M.add(void 0);let R=_.prox=ve(_.prox),P=_.bias??=0;dt.dataIdx=(G,Z,lt,pt)=>{if(Z==0)return lt;let St=lt,Nt=R(G,Z,lt,pt)??ke,Ut=Nt>=0&&Nt<ke,Bt=L.ori==0?O:It,re=dt.left,Te=t[0],Me=t[Z];if(M.has(Me[lt])){St=null;let _e=null,Jt=null,qt;if(P==0||P==-1)for(qt=lt;_e==null&&qt-- >0;)M.has(Me[qt])||(_e=qt);if(P==0||P==1)for(qt=lt;Jt==null&&qt++<Me.length;)M.has(Me[qt])||(Jt=qt);if(_e!=null||Jt!=null)if(Ut){let Xe=_e==null?-1/0:q(Te[_e],L,Bt,0),en=Jt==null?1/0:q(Te[Jt],L,Bt,0),Pn=re-Xe,Oe=en-re;Pn<=Oe?Pn<=Nt&&(St=_e):Oe<=Nt&&(St=Jt)}else St=Jt==null?_e:_e==null?Jt:lt-_e<=Jt-lt?_e:Jt}else Ut&&Tn(re-q(Te[lt],L,Bt,0))>Nt&&(St=null);return St}}let Qt=_=>{dt.event=_};dt.idxs=rt,dt._lock=!1;let ct=dt.points;ct.show=ve(ct.show),ct.size=ve(ct.size),ct.stroke=ve(ct.stroke),ct.width=ve(ct.width),ct.fill=ve(ct.fill);let kt=n.focus=_n({},i.focus||{alpha:.3},dt.focus),te=kt.prox>=0,Rt=te&&ct.one,ce=[],Ge=[],Xn=[];function oa(_,M){let R=ct.show(n,M);if(R instanceof HTMLElement)return Si(R,xw),Si(R,_.class),fs(R,-10,-10,O,It),m.insertBefore(R,ce[M]),R}function Wr(_,M){if(s==1||M>0){let R=s==1&&b[_.scale].time,P=_.value;_.value=R?Jg(P)?s0(J,i0(P,H)):P||tt:P||LT,_.label=_.label||(R?wT:MT)}if(Rt||M>0){_.width=_.width==null?1:_.width,_.paths=_.paths||qT||Ow,_.fillTo=ve(_.fillTo||FT),_.pxAlign=+we(_.pxAlign,y),_.pxRound=f0(_.pxAlign),_.stroke=ve(_.stroke||null),_.fill=ve(_.fill||null),_._stroke=_._fill=_._paths=_._focus=null;let R=DT(si(1,_.width),1),P=_.points=_n({},{size:R,width:si(1,R*.2),stroke:_.stroke,space:R*2,paths:YT,_stroke:null,_fill:null},_.points);P.show=ve(P.show),P.filter=ve(P.filter),P.fill=ve(P.fill),P.stroke=ve(P.stroke),P.paths=ve(P.paths),P.pxAlign=_.pxAlign}if(et){let R=Ue(_,M);oe.splice(M,0,R[0]),Ht.splice(M,0,R[1]),ft.values.push(null)}if(gt){rt.splice(M,0,null);let R=null;Rt?M==0&&(R=oa(_,M)):M>0&&(R=oa(_,M)),ce.splice(M,0,R),Ge.splice(M,0,0),Xn.splice(M,0,0)}In("addSeries",M)}function yu(_,M){M=M??v.length,_=s==1?Sf(_,M,o0,u0):Sf(_,M,{},h0),v.splice(M,0,_),Wr(v[M],M)}n.addSeries=yu;function El(_){if(v.splice(_,1),et){ft.values.splice(_,1),Ht.splice(_,1);let M=oe.splice(_,1)[0];xn(null,M.firstChild),M.remove()}gt&&(rt.splice(_,1),ce.splice(_,1)[0].remove(),Ge.splice(_,1),Xn.splice(_,1)),In("delSeries",_)}n.delSeries=El;let Qi=[!1,!1,!1,!1];function _s(_,M){if(_._show=_.show,_.show){let R=_.side%2,P=b[_.scale];P==null&&(_.scale=R?v[1].scale:A,P=b[_.scale]);let G=P.time;_.size=ve(_.size),_.space=ve(_.space),_.rotate=ve(_.rotate),ur(_.incrs)&&_.incrs.forEach(lt=>{!dr.has(lt)&&dr.set(lt,A0(lt))}),_.incrs=ve(_.incrs||(P.distr==2?sT:G?g==1?oT:cT:Dr)),_.splits=ve(_.splits||(G&&P.distr==1?ht:P.distr==3?_f:P.distr==4?ET:AT)),_.stroke=ve(_.stroke),_.grid.stroke=ve(_.grid.stroke),_.ticks.stroke=ve(_.ticks.stroke),_.border.stroke=ve(_.border.stroke);let Z=_.values;_.values=ur(Z)&&!ur(Z[0])?ve(Z):G?ur(Z)?n0(J,e0(Z,H)):Jg(Z)?dT(J,Z):Z||j:Z||TT,_.filter=ve(_.filter||(P.distr>=3&&P.log==10?IT:P.distr==3&&P.log==2?PT:w0)),_.font=_0(_.font),_.labelFont=_0(_.labelFont),_._size=_.size(n,null,M,0),_._space=_._rotate=_._incrs=_._found=_._splits=_._values=null,_._size>0&&(Qi[M]=!0,_._el=Ii(pw,d))}}function xs(_,M,R,P){let[G,Z,lt,pt]=R,St=M%2,Nt=0;return St==0&&(pt||Z)&&(Nt=M==0&&!G||M==2&&!lt?wn(r0.size/3):0),St==1&&(G||lt)&&(Nt=M==1&&!Z||M==3&&!pt?wn(l0.size/2):0),Nt}let aa=n.padding=(i.padding||[xs,xs,xs,xs]).map(_=>ve(we(_,xs))),Di=n._padding=aa.map((_,M)=>_(n,M,Qi,0)),Qe,rn=null,on=null,ts=s==1?v[0].idxs:null,ui=null,Gs=!1;function la(_,M){if(t=_??[],n.data=n._data=t,s==2){Qe=0;for(let R=1;R<v.length;R++)Qe+=t[R][0].length}else{t.length==0&&(n.data=n._data=t=[[]]),ui=t[0],Qe=ui.length;let R=t;if(X==2){R=t.slice();let P=R[0]=Array(Qe);for(let G=0;G<Qe;G++)P[G]=G}n._data=t=R}if(de(!0),In("setData"),X==2&&(vt=!0),M!==!1){let R=L;R.auto(n,Gs)?ca():Xs(A,R.min,R.max),nt=nt||dt.left>=0,mt=!0,zn()}}n.setData=la;function ca(){Gs=!0;let _,M;s==1&&(Qe>0?(rn=ts[0]=0,on=ts[1]=Qe-1,_=t[0][rn],M=t[0][on],X==2?(_=rn,M=on):_==M&&(X==3?[_,M]=qh(_,_,L.log,!1):X==4?[_,M]=Tf(_,_,L.log,!1):L.time?M=_+wn(86400/g):[_,M]=Hh(_,M,Af,!0))):(rn=ts[0]=_=null,on=ts[1]=M=null)),Xs(A,_,M)}let Xr,Hs,qr,w,B,Q,$,K,At,Lt;function Et(_,M,R,P,G,Z){_??=Ng,R??=Cf,P??="butt",G??=Ng,Z??="round",_!=Xr&&(h.strokeStyle=Xr=_),G!=Hs&&(h.fillStyle=Hs=G),M!=qr&&(h.lineWidth=qr=M),Z!=B&&(h.lineJoin=B=Z),P!=Q&&(h.lineCap=Q=P),R!=w&&h.setLineDash(w=R)}function Dt(_,M,R,P){M!=Hs&&(h.fillStyle=Hs=M),_!=$&&(h.font=$=_),R!=K&&(h.textAlign=K=R),P!=At&&(h.textBaseline=At=P)}function Vt(_,M,R,P,G=0){if(P.length>0&&_.auto(n,Gs)&&(M==null||M.min==null)){let Z=we(rn,0),lt=we(on,P.length-1),pt=R.min==null?Iw(P,Z,lt,G,_.distr==3):[R.min,R.max];_.min=Ki(_.min,R.min=pt[0]),_.max=si(_.max,R.max=pt[1])}}let ne={min:null,max:null};function me(){for(let P in b){let G=b[P];W[P]==null&&(G.min==null||W[A]!=null&&G.auto(n,Gs))&&(W[P]=ne)}for(let P in b){let G=b[P];W[P]==null&&G.from!=null&&W[G.from]!=null&&(W[P]=ne)}W[A]!=null&&de(!0);let _={};for(let P in W){let G=W[P];if(G!=null){let Z=_[P]=Jo(b[P],kw);if(G.min!=null)_n(Z,G);else if(P!=A||s==2)if(Qe==0&&Z.from==null){let lt=Z.range(n,null,null,P);Z.min=lt[0],Z.max=lt[1]}else Z.min=ke,Z.max=-ke}}if(Qe>0){v.forEach((P,G)=>{if(s==1){let Z=P.scale,lt=W[Z];if(lt==null)return;let pt=_[Z];if(G==0){let St=pt.range(n,pt.min,pt.max,Z);pt.min=St[0],pt.max=St[1],rn=$i(pt.min,t[0]),on=$i(pt.max,t[0]),on-rn>1&&(t[0][rn]<pt.min&&rn++,t[0][on]>pt.max&&on--),P.min=ui[rn],P.max=ui[on]}else P.show&&P.auto&&Vt(pt,lt,P,t[G],P.sorted);P.idxs[0]=rn,P.idxs[1]=on}else if(G>0&&P.show&&P.auto){let[Z,lt]=P.facets,pt=Z.scale,St=lt.scale,[Nt,Ut]=t[G],Bt=_[pt],re=_[St];Bt!=null&&Vt(Bt,W[pt],Z,Nt,Z.sorted),re!=null&&Vt(re,W[St],lt,Ut,lt.sorted),P.min=lt.min,P.max=lt.max}});for(let P in _){let G=_[P],Z=W[P];if(G.from==null&&(Z==null||Z.min==null)){let lt=G.range(n,G.min==ke?null:G.min,G.max==-ke?null:G.max,P);G.min=lt[0],G.max=lt[1]}}}for(let P in _){let G=_[P];if(G.from!=null){let Z=_[G.from];if(Z.min==null)G.min=G.max=null;else{let lt=G.range(n,Z.min,Z.max,P);G.min=lt[0],G.max=lt[1]}}}let M={},R=!1;for(let P in _){let G=_[P],Z=b[P];if(Z.min!=G.min||Z.max!=G.max){Z.min=G.min,Z.max=G.max;let lt=Z.distr;Z._min=lt==3?Bs(Z.min):lt==4?lf(Z.min,Z.asinh):lt==100?Z.fwd(Z.min):Z.min,Z._max=lt==3?Bs(Z.max):lt==4?lf(Z.max,Z.asinh):lt==100?Z.fwd(Z.max):Z.max,M[P]=R=!0}}if(R){v.forEach((P,G)=>{s==2?G>0&&M.y&&(P._paths=null):M[P.scale]&&(P._paths=null)});for(let P in M)vt=!0,In("setScale",P);gt&&dt.left>=0&&(nt=mt=!0)}for(let P in W)W[P]=null}function zt(_){let M=gf(rn-1,0,Qe-1),R=gf(on+1,0,Qe-1);for(;_[M]==null&&M>0;)M--;for(;_[R]==null&&R<Qe-1;)R++;return[M,R]}function ge(){if(Qe>0){let _=v.some(M=>M._focus)&&Lt!=kt.alpha;_&&(h.globalAlpha=Lt=kt.alpha),v.forEach((M,R)=>{if(R>0&&M.show&&(Ze(R,!1),Ze(R,!0),M._paths==null)){let P=Lt;Lt!=M.alpha&&(h.globalAlpha=Lt=M.alpha);let G=s==2?[0,t[R][0].length-1]:zt(t[R]);M._paths=M.paths(n,R,G[0],G[1]),Lt!=P&&(h.globalAlpha=Lt=P)}}),v.forEach((M,R)=>{if(R>0&&M.show){let P=Lt;Lt!=M.alpha&&(h.globalAlpha=Lt=M.alpha),M._paths!=null&&Le(R,!1);{let G=M._paths!=null?M._paths.gaps:null,Z=M.points.show(n,R,rn,on,G),lt=M.points.filter(n,R,Z,G);(Z||lt)&&(M.points._paths=M.points.paths(n,R,rn,on,lt),Le(R,!0))}Lt!=P&&(h.globalAlpha=Lt=P),In("drawSeries",R)}}),_&&(h.globalAlpha=Lt=1)}}function Ze(_,M){let R=M?v[_].points:v[_];R._stroke=R.stroke(n,_),R._fill=R.fill(n,_)}function Le(_,M){let R=M?v[_].points:v[_],{stroke:P,fill:G,clip:Z,flags:lt,_stroke:pt=R._stroke,_fill:St=R._fill,_width:Nt=R.width}=R._paths;Nt=ze(Nt*Ee,3);let Ut=null,Bt=Nt%2/2;M&&St==null&&(St=Nt>0?"#fff":pt);let re=R.pxAlign==1&&Bt>0;if(re&&h.translate(Bt,Bt),!M){let Te=C-Nt/2,Me=S-Nt/2,_e=Y+Nt,Jt=ut+Nt;Ut=new Path2D,Ut.rect(Te,Me,_e,Jt)}M?Ft(pt,Nt,R.dash,R.cap,St,P,G,lt,Z):De(_,pt,Nt,R.dash,R.cap,St,P,G,lt,Ut,Z),re&&h.translate(-Bt,-Bt)}function De(_,M,R,P,G,Z,lt,pt,St,Nt,Ut){let Bt=!1;St!=0&&I.forEach((re,Te)=>{if(re.series[0]==_){let Me=v[re.series[1]],_e=t[re.series[1]],Jt=(Me._paths||_l).band;ur(Jt)&&(Jt=re.dir==1?Jt[0]:Jt[1]);let qt,Xe=null;Me.show&&Jt&&Lw(_e,rn,on)?(Xe=re.fill(n,Te)||Z,qt=Me._paths.clip):Jt=null,Ft(M,R,P,G,Xe,lt,pt,St,Nt,Ut,qt,Jt),Bt=!0}}),Bt||Ft(M,R,P,G,Z,lt,pt,St,Nt,Ut)}let yn=jo|yf;function Ft(_,M,R,P,G,Z,lt,pt,St,Nt,Ut,Bt){Et(_,M,R,P,G),(St||Nt||Bt)&&(h.save(),St&&h.clip(St),Nt&&h.clip(Nt)),Bt?(pt&yn)==yn?(h.clip(Bt),Ut&&h.clip(Ut),xe(G,lt),cn(_,Z,M)):pt&yf?(xe(G,lt),h.clip(Bt),cn(_,Z,M)):pt&jo&&(h.save(),h.clip(Bt),Ut&&h.clip(Ut),xe(G,lt),h.restore(),cn(_,Z,M)):(xe(G,lt),cn(_,Z,M)),(St||Nt||Bt)&&h.restore()}function cn(_,M,R){R>0&&(M instanceof Map?M.forEach((P,G)=>{h.strokeStyle=Xr=G,h.stroke(P)}):M!=null&&_&&h.stroke(M))}function xe(_,M){M instanceof Map?M.forEach((R,P)=>{h.fillStyle=Hs=P,h.fill(R)}):M!=null&&_&&h.fill(M)}function ys(_,M,R,P){let G=E[_],Z;if(P<=0)Z=[0,0];else{let lt=G._space=G.space(n,_,M,R,P),pt=G._incrs=G.incrs(n,_,M,R,P,lt);Z=QT(M,R,pt,P,lt)}return G._found=Z}function hn(_,M,R,P,G,Z,lt,pt,St,Nt){let Ut=lt%2/2;y==1&&h.translate(Ut,Ut),Et(pt,lt,St,Nt,pt),h.beginPath();let Bt,re,Te,Me,_e=G+(P==0||P==3?-Z:Z);R==0?(re=G,Me=_e):(Bt=G,Te=_e);for(let Jt=0;Jt<_.length;Jt++)M[Jt]!=null&&(R==0?Bt=Te=_[Jt]:re=Me=_[Jt],h.moveTo(Bt,re),h.lineTo(Te,Me));h.stroke(),y==1&&h.translate(-Ut,-Ut)}function Yr(_){let M=!0;return E.forEach((R,P)=>{if(!R.show)return;let G=b[R.scale];if(G.min==null){R._show&&(M=!1,R._show=!1,de(!1));return}else R._show||(M=!1,R._show=!0,de(!1));let Z=R.side,lt=Z%2,{min:pt,max:St}=G,[Nt,Ut]=ys(P,pt,St,lt==0?O:It);if(Ut==0)return;let Bt=G.distr==2,re=R._splits=R.splits(n,P,pt,St,Nt,Ut,Bt),Te=G.distr==2?re.map(qt=>ui[qt]):re,Me=G.distr==2?ui[re[1]]-ui[re[0]]:Nt,_e=R._values=R.values(n,R.filter(n,Te,P,Ut,Me),P,Ut,Me);R._rotate=Z==2?R.rotate(n,_e,P,Ut):0;let Jt=R._size;R._size=Pi(R.size(n,_e,P,_)),Jt!=null&&R._size!=Jt&&(M=!1)}),M}function es(_){let M=!0;return aa.forEach((R,P)=>{let G=R(n,P,Qi,_);G!=Di[P]&&(M=!1),Di[P]=G}),M}function vs(){for(let _=0;_<E.length;_++){let M=E[_];if(!M.show||!M._show)continue;let R=M.side,P=R%2,G,Z,lt=M.stroke(n,_),pt=R==0||R==3?-1:1,[St,Nt]=M._found;if(M.label!=null){let $n=M.labelGap*pt,pi=wn((M._lpos+$n)*Ee);Dt(M.labelFont[0],lt,"center",R==2?"top":Dg),h.save(),P==1?(G=Z=0,h.translate(pi,wn(S+ut/2)),h.rotate((R==3?-Vh:Vh)/2)):(G=wn(C+Y/2),Z=pi);let _r=b0(M.label)?M.label(n,_,St,Nt):M.label;h.fillText(_r,G,Z),h.restore()}if(Nt==0)continue;let Ut=b[M.scale],Bt=P==0?Y:ut,re=P==0?C:S,Te=M._splits,Me=Ut.distr==2?Te.map($n=>ui[$n]):Te,_e=Ut.distr==2?ui[Te[1]]-ui[Te[0]]:St,Jt=M.ticks,qt=M.border,Xe=Jt.show?Jt.size:0,en=wn(Xe*Ee),Pn=wn((M.alignTo==2?M._size-Xe-M.gap:M.gap)*Ee),Oe=M._rotate*-Vh/180,nn=p(M._pos*Ee),di=(en+Pn)*pt,Yn=nn+di;Z=P==0?Yn:0,G=P==1?Yn:0;let wi=M.font[0],Ni=M.align==1?qo:M.align==2?rf:Oe>0?qo:Oe<0?rf:P==0?"center":R==3?rf:qo,ss=Oe||P==1?"middle":R==2?"top":Dg;Dt(wi,lt,Ni,ss);let fi=M.font[1]*M.lineGap,Ti=Te.map($n=>p(a($n,Ut,Bt,re))),Ui=M._values;for(let $n=0;$n<Ui.length;$n++){let pi=Ui[$n];if(pi!=null){P==0?G=Ti[$n]:Z=Ti[$n],pi=""+pi;let _r=pi.indexOf(`
`)==-1?[pi]:pi.split(/\n/gm);for(let Kn=0;Kn<_r.length;Kn++){let vp=_r[Kn];Oe?(h.save(),h.translate(G,Z+Kn*fi),h.rotate(Oe),h.fillText(vp,0,0),h.restore()):h.fillText(vp,G,Z+Kn*fi)}}}Jt.show&&hn(Ti,Jt.filter(n,Me,_,Nt,_e),P,R,nn,en,ze(Jt.width*Ee,3),Jt.stroke(n,_),Jt.dash,Jt.cap);let rs=M.grid;rs.show&&hn(Ti,rs.filter(n,Me,_,Nt,_e),P,P==0?2:1,P==0?S:C,P==0?ut:Y,ze(rs.width*Ee,3),rs.stroke(n,_),rs.dash,rs.cap),qt.show&&hn([nn],[1],P==0?1:0,P==0?1:2,P==1?S:C,P==1?ut:Y,ze(qt.width*Ee,3),qt.stroke(n,_),qt.dash,qt.cap)}In("drawAxes")}function de(_){v.forEach((M,R)=>{R>0&&(M._paths=null,_&&(s==1?(M.min=null,M.max=null):M.facets.forEach(P=>{P.min=null,P.max=null})))})}let tn=!1,qn=!1,Ne=[];function un(){qn=!1;for(let _=0;_<Ne.length;_++)In(...Ne[_]);Ne.length=0}function zn(){tn||(qw(np),tn=!0)}function Cl(_,M=!1){tn=!0,qn=M,_(n),np(),M&&Ne.length>0&&queueMicrotask(un)}n.batch=Cl;function np(){if(at&&(me(),at=!1),vt&&(Tt(),vt=!1),xt){if(Ye(f,qo,Kt),Ye(f,"top",ae),Ye(f,fl,O),Ye(f,pl,It),Ye(m,qo,Kt),Ye(m,"top",ae),Ye(m,fl,O),Ye(m,pl,It),Ye(d,fl,je),Ye(d,pl,ln),u.width=wn(je*Ee),u.height=wn(ln*Ee),E.forEach(({_el:_,_show:M,_size:R,_pos:P,side:G})=>{if(_!=null)if(M){let Z=G===3||G===0?R:0,lt=G%2==1;Ye(_,lt?"left":"top",P-Z),Ye(_,lt?"width":"height",R),Ye(_,lt?"top":"left",lt?ae:Kt),Ye(_,lt?"height":"width",lt?It:O),pf(_,Nr)}else Si(_,Nr)}),Xr=Hs=qr=B=Q=$=K=At=w=null,Lt=1,da(!0),Kt!=wt||ae!=Be||O!=Gt||It!=Yt){de(!1);let _=O/Gt,M=It/Yt;if(gt&&!nt&&dt.left>=0){dt.left*=_,dt.top*=M,$r&&fs($r,wn(dt.left),0,O,It),Kr&&fs(Kr,0,wn(dt.top),O,It);for(let R=0;R<ce.length;R++){let P=ce[R];P!=null&&(Ge[R]*=_,Xn[R]*=M,fs(P,Pi(Ge[R]),Pi(Xn[R]),O,It))}}if(We.show&&!st&&We.left>=0&&We.width>0){We.left*=_,We.width*=_,We.top*=M,We.height*=M;for(let R in Tu)Ye(jr,R,We[R])}wt=Kt,Be=ae,Gt=O,Yt=It}In("setSize"),xt=!1}je>0&&ln>0&&(h.clearRect(0,0,u.width,u.height),In("drawClear"),T.forEach(_=>_()),In("draw")),We.show&&st&&(Rl(We),st=!1),gt&&nt&&(gr(null,!0,!1),nt=!1),ft.show&&ft.live&&mt&&(Mu(),mt=!1),l||(l=!0,n.status=1,In("ready")),Gs=!1,tn=!1}n.redraw=(_,M)=>{vt=M||!1,_!==!1?Xs(A,L.min,L.max):zn()};function vu(_,M){let R=b[_];if(R.from==null){if(Qe==0){let P=R.range(n,M.min,M.max,_);M.min=P[0],M.max=P[1]}if(M.min>M.max){let P=M.min;M.min=M.max,M.max=P}if(Qe>1&&M.min!=null&&M.max!=null&&M.max-M.min<1e-16)return;_==A&&R.distr==2&&Qe>0&&(M.min=$i(M.min,t[0]),M.max=$i(M.max,t[0]),M.min==M.max&&M.max++),W[_]=M,at=!0,zn()}}n.setScale=vu;let Su,bu,$r,Kr,ip,sp,Zr,Jr,rp,op,He,Ke,Ws=!1,Nn=dt.drag,Cn=Nn.x,Rn=Nn.y;gt&&(dt.x&&(Su=Ii(gw,m)),dt.y&&(bu=Ii(_w,m)),L.ori==0?($r=Su,Kr=bu):($r=bu,Kr=Su),He=dt.left,Ke=dt.top);let We=n.select=_n({show:!0,over:!0,left:0,width:0,top:0,height:0},i.select),jr=We.show?Ii(mw,We.over?m:f):null;function Rl(_,M){if(We.show){for(let R in _)We[R]=_[R],R in Tu&&Ye(jr,R,_[R]);M!==!1&&In("setSelect")}}n.setSelect=Rl;function G_(_){if(v[_].show)et&&pf(oe[_],Nr);else if(et&&Si(oe[_],Nr),gt){let R=Rt?ce[0]:ce[_];R!=null&&fs(R,-10,-10,O,It)}}function Xs(_,M,R){vu(_,{min:M,max:R})}function ns(_,M,R,P){M.focus!=null&&Y_(_),M.show!=null&&v.forEach((G,Z)=>{Z>0&&(_==Z||_==null)&&(G.show=M.show,G_(Z),s==2?(Xs(G.facets[0].scale,null,null),Xs(G.facets[1].scale,null,null)):Xs(G.scale,null,null),zn())}),R!==!1&&In("setSeries",_,M),P&&fa("setSeries",n,_,M)}n.setSeries=ns;function H_(_,M){_n(I[_],M)}function W_(_,M){_.fill=ve(_.fill||null),_.dir=we(_.dir,-1),M=M??I.length,I.splice(M,0,_)}function X_(_){_==null?I.length=0:I.splice(_,1)}n.addBand=W_,n.setBand=H_,n.delBand=X_;function q_(_,M){v[_].alpha=M,gt&&ce[_]!=null&&(ce[_].style.opacity=M),et&&oe[_]&&(oe[_].style.opacity=M)}let Ss,qs,mr,Qr={focus:!0};function Y_(_){if(_!=mr){let M=_==null,R=kt.alpha!=1;v.forEach((P,G)=>{if(s==1||G>0){let Z=M||G==0||G==_;P._focus=M?null:Z,R&&q_(G,Z?1:kt.alpha)}}),mr=_,R&&zn()}}et&&te&&Se(Fg,Ct,_=>{dt._lock||(Qt(_),mr!=null&&ns(null,Qr,!0,dn.setSeries))});function is(_,M,R){let P=b[M];R&&(_=_/Ee-(P.ori==1?ae:Kt));let G=O;P.ori==1&&(G=It,_=G-_),P.dir==-1&&(_=G-_);let Z=P._min,lt=P._max,pt=_/G,St=Z+(lt-Z)*pt,Nt=P.distr;return Nt==3?Ko(10,St):Nt==4?Nw(St,P.asinh):Nt==100?P.bwd(St):St}function $_(_,M){let R=is(_,A,M);return $i(R,t[0],rn,on)}n.valToIdx=_=>$i(_,t[0]),n.posToIdx=$_,n.posToVal=is,n.valToPos=(_,M,R)=>b[M].ori==0?r(_,b[M],R?Y:O,R?C:0):o(_,b[M],R?ut:It,R?S:0),n.setCursor=(_,M,R)=>{He=_.left,Ke=_.top,gr(null,M,R)};function ap(_,M){Ye(jr,qo,We.left=_),Ye(jr,fl,We.width=M)}function lp(_,M){Ye(jr,"top",We.top=_),Ye(jr,pl,We.height=M)}let ha=L.ori==0?ap:lp,ua=L.ori==1?ap:lp;function K_(){if(et&&ft.live)for(let _=s==2?1:0;_<v.length;_++){if(_==0&&ue)continue;let M=ft.values[_],R=0;for(let P in M)Ht[_][R++].firstChild.nodeValue=M[P]}}function Mu(_,M){if(_!=null&&(_.idxs?_.idxs.forEach((R,P)=>{rt[P]=R}):Bw(_.idx)||rt.fill(_.idx),ft.idx=rt[0]),et&&ft.live){for(let R=0;R<v.length;R++)(R>0||s==1&&!ue)&&Z_(R,rt[R]);K_()}mt=!1,M!==!1&&In("setLegend")}n.setLegend=Mu;function Z_(_,M){let R=v[_],P=_==0&&X==2?ui:t[_],G;ue?G=R.values(n,_,M)??se:(G=R.value(n,M==null?null:P[M],_,M),G=G==null?se:{_:G}),ft.values[_]=G}function gr(_,M,R){rp=He,op=Ke,[He,Ke]=dt.move(n,He,Ke),dt.left=He,dt.top=Ke,gt&&($r&&fs($r,wn(He),0,O,It),Kr&&fs(Kr,0,wn(Ke),O,It));let P,G=rn>on;Ss=ke,qs=null;let Z=L.ori==0?O:It,lt=L.ori==1?O:It;if(He<0||Qe==0||G){P=dt.idx=null;for(let pt=0;pt<v.length;pt++){let St=ce[pt];St!=null&&fs(St,-10,-10,O,It)}te&&ns(null,Qr,!0,_==null&&dn.setSeries),ft.live&&(rt.fill(P),mt=!0)}else{let pt,St,Nt;s==1&&(pt=L.ori==0?He:Ke,St=is(pt,A),P=dt.idx=$i(St,t[0],rn,on),Nt=q(t[0][P],L,Z,0));let Ut=-10,Bt=-10,re=0,Te=0,Me=!0,_e="",Jt="";for(let qt=s==2?1:0;qt<v.length;qt++){let Xe=v[qt],en=rt[qt],Pn=en==null?null:s==1?t[qt][en]:t[qt][1][en],Oe=dt.dataIdx(n,qt,P,St),nn=Oe==null?null:s==1?t[qt][Oe]:t[qt][1][Oe];if(mt=mt||nn!=Pn||Oe!=en,rt[qt]=Oe,qt>0&&Xe.show){let di=Oe==null?-10:Oe==P?Nt:q(s==1?t[0][Oe]:t[qt][0][Oe],L,Z,0),Yn=nn==null?-10:D(nn,s==1?b[Xe.scale]:b[Xe.facets[1].scale],lt,0);if(te&&nn!=null){let wi=L.ori==1?He:Ke,Ni=Tn(kt.dist(n,qt,Oe,Yn,wi));if(Ni<Ss){let ss=kt.bias;if(ss!=0){let fi=is(wi,Xe.scale),Ti=nn>=0?1:-1,Ui=fi>=0?1:-1;Ui==Ti&&(Ui==1?ss==1?nn>=fi:nn<=fi:ss==1?nn<=fi:nn>=fi)&&(Ss=Ni,qs=qt)}else Ss=Ni,qs=qt}}if(mt||Rt){let wi,Ni;L.ori==0?(wi=di,Ni=Yn):(wi=Yn,Ni=di);let ss,fi,Ti,Ui,rs,$n,pi=!0,_r=ct.bbox;if(_r!=null){pi=!1;let Kn=_r(n,qt);Ti=Kn.left,Ui=Kn.top,ss=Kn.width,fi=Kn.height}else Ti=wi,Ui=Ni,ss=fi=ct.size(n,qt);if($n=ct.fill(n,qt),rs=ct.stroke(n,qt),Rt)qt==qs&&Ss<=kt.prox&&(Ut=Ti,Bt=Ui,re=ss,Te=fi,Me=pi,_e=$n,Jt=rs);else{let Kn=ce[qt];Kn!=null&&(Ge[qt]=Ti,Xn[qt]=Ui,Wg(Kn,ss,fi,pi),Gg(Kn,$n,rs),fs(Kn,Pi(Ti),Pi(Ui),O,It))}}}}if(Rt){let qt=kt.prox,Xe=mr==null?Ss<=qt:Ss>qt||qs!=mr;if(mt||Xe){let en=ce[0];en!=null&&(Ge[0]=Ut,Xn[0]=Bt,Wg(en,re,Te,Me),Gg(en,_e,Jt),fs(en,Pi(Ut),Pi(Bt),O,It))}}}if(We.show&&Ws)if(_!=null){let[pt,St]=dn.scales,[Nt,Ut]=dn.match,[Bt,re]=_.cursor.sync.scales,Te=_.cursor.drag;if(Cn=Te._x,Rn=Te._y,Cn||Rn){let{left:Me,top:_e,width:Jt,height:qt}=_.select,Xe=_.scales[Bt].ori,en=_.posToVal,Pn,Oe,nn,di,Yn,wi=pt!=null&&Nt(pt,Bt),Ni=St!=null&&Ut(St,re);wi&&Cn?(Xe==0?(Pn=Me,Oe=Jt):(Pn=_e,Oe=qt),nn=b[pt],di=q(en(Pn,Bt),nn,Z,0),Yn=q(en(Pn+Oe,Bt),nn,Z,0),ha(Ki(di,Yn),Tn(Yn-di))):ha(0,Z),Ni&&Rn?(Xe==1?(Pn=Me,Oe=Jt):(Pn=_e,Oe=qt),nn=b[St],di=D(en(Pn,re),nn,lt,0),Yn=D(en(Pn+Oe,re),nn,lt,0),ua(Ki(di,Yn),Tn(Yn-di))):ua(0,lt)}else Au()}else{let pt=Tn(rp-ip),St=Tn(op-sp);if(L.ori==1){let re=pt;pt=St,St=re}Cn=Nn.x&&pt>=Nn.dist,Rn=Nn.y&&St>=Nn.dist;let Nt=Nn.uni;Nt!=null?Cn&&Rn&&(Cn=pt>=Nt,Rn=St>=Nt,!Cn&&!Rn&&(St>pt?Rn=!0:Cn=!0)):Nn.x&&Nn.y&&(Cn||Rn)&&(Cn=Rn=!0);let Ut,Bt;Cn&&(L.ori==0?(Ut=Zr,Bt=He):(Ut=Jr,Bt=Ke),ha(Ki(Ut,Bt),Tn(Bt-Ut)),Rn||ua(0,lt)),Rn&&(L.ori==1?(Ut=Zr,Bt=He):(Ut=Jr,Bt=Ke),ua(Ki(Ut,Bt),Tn(Bt-Ut)),Cn||ha(0,Z)),!Cn&&!Rn&&(ha(0,0),ua(0,0))}if(Nn._x=Cn,Nn._y=Rn,_==null){if(R){if(yp!=null){let[pt,St]=dn.scales;dn.values[0]=pt!=null?is(L.ori==0?He:Ke,pt):null,dn.values[1]=St!=null?is(L.ori==1?He:Ke,St):null}fa(of,n,He,Ke,O,It,P)}if(te){let pt=R&&dn.setSeries,St=kt.prox;mr==null?Ss<=St&&ns(qs,Qr,!0,pt):Ss>St?ns(null,Qr,!0,pt):qs!=mr&&ns(qs,Qr,!0,pt)}}mt&&(ft.idx=P,Mu()),M!==!1&&In("setCursor")}let Ys=null;Object.defineProperty(n,"rect",{get(){return Ys==null&&da(!1),Ys}});function da(_=!1){_?Ys=null:(Ys=m.getBoundingClientRect(),In("syncRect",Ys))}function cp(_,M,R,P,G,Z,lt){dt._lock||Ws&&_!=null&&_.movementX==0&&_.movementY==0||(wu(_,M,R,P,G,Z,lt,!1,_!=null),_!=null?gr(null,!0,!0):gr(M,!0,!1))}function wu(_,M,R,P,G,Z,lt,pt,St){if(Ys==null&&da(!1),Qt(_),_!=null)R=_.clientX-Ys.left,P=_.clientY-Ys.top;else{if(R<0||P<0){He=-10,Ke=-10;return}let[Nt,Ut]=dn.scales,Bt=M.cursor.sync,[re,Te]=Bt.values,[Me,_e]=Bt.scales,[Jt,qt]=dn.match,Xe=M.axes[0].side%2==1,en=L.ori==0?O:It,Pn=L.ori==1?O:It,Oe=Xe?Z:G,nn=Xe?G:Z,di=Xe?P:R,Yn=Xe?R:P;if(Me!=null?R=Jt(Nt,Me)?a(re,b[Nt],en,0):-10:R=en*(di/Oe),_e!=null?P=qt(Ut,_e)?a(Te,b[Ut],Pn,0):-10:P=Pn*(Yn/nn),L.ori==1){let wi=R;R=P,P=wi}}St&&(M==null||M.cursor.event.type==of)&&((R<=1||R>=O-1)&&(R=Lr(R,O)),(P<=1||P>=It-1)&&(P=Lr(P,It))),pt?(ip=R,sp=P,[Zr,Jr]=dt.move(n,R,P)):(He=R,Ke=P)}let Tu={width:0,height:0,left:0,top:0};function Au(){Rl(Tu,!1)}let hp,up,dp,fp;function pp(_,M,R,P,G,Z,lt){Ws=!0,Cn=Rn=Nn._x=Nn._y=!1,wu(_,M,R,P,G,Z,lt,!0,!1),_!=null&&(Se(af,df,mp,!1),fa(Ug,n,Zr,Jr,O,It,null));let{left:pt,top:St,width:Nt,height:Ut}=We;hp=pt,up=St,dp=Nt,fp=Ut}function mp(_,M,R,P,G,Z,lt){Ws=Nn._x=Nn._y=!1,wu(_,M,R,P,G,Z,lt,!1,!0);let{left:pt,top:St,width:Nt,height:Ut}=We,Bt=Nt>0||Ut>0,re=hp!=pt||up!=St||dp!=Nt||fp!=Ut;if(Bt&&re&&Rl(We),Nn.setScale&&Bt&&re){let Te=pt,Me=Nt,_e=St,Jt=Ut;if(L.ori==1&&(Te=St,Me=Ut,_e=pt,Jt=Nt),Cn&&Xs(A,is(Te,A),is(Te+Me,A)),Rn)for(let qt in b){let Xe=b[qt];qt!=A&&Xe.from==null&&Xe.min!=ke&&Xs(qt,is(_e+Jt,qt),is(_e,qt))}Au()}else dt.lock&&(dt._lock=!dt._lock,gr(M,!0,_!=null));_!=null&&(xn(af,df),fa(af,n,He,Ke,O,It,null))}function J_(_,M,R,P,G,Z,lt){if(dt._lock)return;Qt(_);let pt=Ws;if(Ws){let St=!0,Nt=!0,Ut=10,Bt,re;L.ori==0?(Bt=Cn,re=Rn):(Bt=Rn,re=Cn),Bt&&re&&(St=He<=Ut||He>=O-Ut,Nt=Ke<=Ut||Ke>=It-Ut),Bt&&St&&(He=He<Zr?0:O),re&&Nt&&(Ke=Ke<Jr?0:It),gr(null,!0,!0),Ws=!1}He=-10,Ke=-10,rt.fill(null),gr(null,!0,!0),pt&&(Ws=pt)}function gp(_,M,R,P,G,Z,lt){dt._lock||(Qt(_),ca(),Au(),_!=null&&fa(Bg,n,He,Ke,O,It,null))}function _p(){E.forEach(tA),U(n.width,n.height,!0)}Ur(Gh,$o,_p);let to={};to.mousedown=pp,to.mousemove=cp,to.mouseup=mp,to.dblclick=gp,to.setSeries=(_,M,R,P)=>{let G=dn.match[2];R=G(n,M,R),R!=-1&&ns(R,P,!0,!1)},gt&&(Se(Ug,m,pp),Se(of,m,cp),Se(Og,m,_=>{Qt(_),da(!1)}),Se(Fg,m,J_),Se(Bg,m,gp),vf.add(n),n.syncRect=da);let Il=n.hooks=i.hooks||{};function In(_,M,R){qn?Ne.push([_,M,R]):_ in Il&&Il[_].forEach(P=>{P.call(null,n,M,R)})}(i.plugins||[]).forEach(_=>{for(let M in _.hooks)Il[M]=(Il[M]||[]).concat(_.hooks[M])});let xp=(_,M,R)=>R,dn=_n({key:null,setSeries:!1,filters:{pub:Kg,sub:Kg},scales:[A,v[1]?v[1].scale:null],match:[Zg,Zg,xp],values:[null,null]},dt.sync);dn.match.length==2&&dn.match.push(xp),dt.sync=dn;let yp=dn.key,Eu=q0(yp);function fa(_,M,R,P,G,Z,lt){dn.filters.pub(_,M,R,P,G,Z,lt)&&Eu.pub(_,M,R,P,G,Z,lt)}Eu.sub(n);function j_(_,M,R,P,G,Z,lt){dn.filters.sub(_,M,R,P,G,Z,lt)&&to[_](null,M,R,P,G,Z,lt)}n.pub=j_;function Q_(){Eu.unsub(n),vf.delete(n),En.clear(),mf(Gh,$o,_p),c.remove(),Ct?.remove(),In("destroy")}n.destroy=Q_;function Cu(){In("init",i,t),la(t||i.data,!1),W[A]?vu(A,W[A]):ca(),st=We.show&&(We.width>0||We.height>0),nt=mt=!0,U(i.width,i.height)}return v.forEach(Wr),E.forEach(_s),e?e instanceof HTMLElement?(e.appendChild(c),Cu()):e(n,Cu):Cu(),n}On.assign=_n;On.fmtNum=Ef;On.rangeNum=Hh;On.rangeLog=qh;On.rangeAsinh=Tf;On.orient=Fr;On.pxRatio=Ee;On.join=Xw;On.fmtDate=Rf,On.tzDate=nT;On.sync=q0;{On.addGap=BT,On.clipGaps=Kh;let i=On.paths={points:j0};i.linear=t_,i.stepped=VT,i.bars=GT,i.spline=WT}function s_(i,t){let e=[0,1,2,3,4,5,6,7,8].find(n=>t.every(s=>s==null||Math.abs(s-Number(s.toFixed(n)))<=1e-9*Math.abs(s)))??8;return t.map(n=>n==null?"":n.toFixed(e).replace("-","\u2212"))}var eA=(i,t)=>16+7*Math.max(3,...(t??[]).map(e=>e?.length??0)),Zi=class{constructor({x:t,y:e,pick:n,height:s}){this.box=F("div",{class:"plot"}),this.labels={x:t,y:e},this.pick=n,this.height=s,new ResizeObserver(()=>this.size()).observe(this.box)}size(){this.plot&&this.box.clientWidth>0&&this.plot.setSize({width:this.box.clientWidth,height:this.room()})}room(){let t=[".u-legend",".u-title"].map(e=>this.plot?.root.querySelector(e)?.offsetHeight??26);return this.height??Math.max(120,this.box.clientHeight-10-t[0]-t[1])}show(t,e,{title:n,marks:s,y:r,names:o}={}){this.last=[t,e,{title:n,marks:s,y:r,names:o}],this.plot?.destroy();let a=Zn("ink"),l=Zn("grid"),c=h=>({label:h,stroke:a,grid:{stroke:l,width:1},ticks:{stroke:l},labelSize:18,size:42,labelFont:"12px system-ui",font:"11px system-ui"}),u=o&&{splits:()=>o.map((h,d)=>d),values:(h,d)=>d.map(f=>o[f]??"")};this.plot=new On({width:Math.max(100,this.box.clientWidth),height:this.room(),title:n,scales:{x:{time:!1,...o&&{range:[-.3,o.length-.7]}},y:{range:r}},axes:[{...c(this.labels.x),values:s_,...u},{...c(this.labels.y),values:s_,size:eA}],cursor:{drag:{x:!0,y:!1},points:{size:6}},series:[{label:this.labels.x,...o&&{value:(h,d)=>o[d]??"\u2013"}},...e.map(h=>({label:h.label,stroke:h.colour,width:h.points?0:h.width??1.5,dash:h.dash,points:{show:!!h.points,size:7,fill:h.colour},value:(d,f)=>f==null?"\u2013":h.told?.(f)??f.toFixed(2)}))],hooks:{draw:[h=>{for(let d of s??[]){let f=h.valToPos(d.x,"x",!0);h.ctx.save(),h.ctx.strokeStyle=d.colour??a,h.ctx.setLineDash([4,3]),h.ctx.beginPath(),h.ctx.moveTo(f,h.bbox.top),h.ctx.lineTo(f,h.bbox.top+h.bbox.height),h.ctx.stroke(),h.ctx.restore()}}],setCursor:[h=>h.cursor.idx!=null&&self.pick?.(h.cursor.idx)]}},[t,...e.map(h=>h.values)],this.box),requestAnimationFrame(()=>this.size())}again(){this.last&&this.show(...this.last)}};var r_={type:"change"},Ff={type:"start"},a_={type:"end"},Qh=new Ls,o_=new _i,nA=Math.cos(70*ja.DEG2RAD),An=new k,li=2*Math.PI,Ce={NONE:-1,ROTATE:0,DOLLY:1,PAN:2,TOUCH_ROTATE:3,TOUCH_PAN:4,TOUCH_DOLLY_PAN:5,TOUCH_DOLLY_ROTATE:6},Of=1e-6,tu=class extends Ha{constructor(t,e=null){super(t,e),this.state=Ce.NONE,this.target=new k,this.cursor=new k,this.minDistance=0,this.maxDistance=1/0,this.minZoom=0,this.maxZoom=1/0,this.minTargetRadius=0,this.maxTargetRadius=1/0,this.minPolarAngle=0,this.maxPolarAngle=Math.PI,this.minAzimuthAngle=-1/0,this.maxAzimuthAngle=1/0,this.enableDamping=!1,this.dampingFactor=.05,this.enableZoom=!0,this.zoomSpeed=1,this.enableRotate=!0,this.rotateSpeed=1,this.keyRotateSpeed=1,this.enablePan=!0,this.panSpeed=1,this.screenSpacePanning=!0,this.keyPanSpeed=7,this.zoomToCursor=!1,this.autoRotate=!1,this.autoRotateSpeed=2,this.keys={LEFT:"ArrowLeft",UP:"ArrowUp",RIGHT:"ArrowRight",BOTTOM:"ArrowDown"},this.mouseButtons={LEFT:or.ROTATE,MIDDLE:or.DOLLY,RIGHT:or.PAN},this.touches={ONE:ar.ROTATE,TWO:ar.DOLLY_PAN},this.target0=this.target.clone(),this.position0=this.object.position.clone(),this.zoom0=this.object.zoom,this._cursorStyle="auto",this._domElementKeyEvents=null,this._lastPosition=new k,this._lastQuaternion=new Je,this._lastTargetPosition=new k,this._quat=new Je().setFromUnitVectors(t.up,new k(0,1,0)),this._quatInverse=this._quat.clone().invert(),this._spherical=new Oo,this._sphericalDelta=new Oo,this._scale=1,this._panOffset=new k,this._rotateStart=new Zt,this._rotateEnd=new Zt,this._rotateDelta=new Zt,this._panStart=new Zt,this._panEnd=new Zt,this._panDelta=new Zt,this._dollyStart=new Zt,this._dollyEnd=new Zt,this._dollyDelta=new Zt,this._dollyDirection=new k,this._mouse=new Zt,this._performCursorZoom=!1,this._pointers=[],this._pointerPositions={},this._controlActive=!1,this._onPointerMove=sA.bind(this),this._onPointerDown=iA.bind(this),this._onPointerUp=rA.bind(this),this._onContextMenu=dA.bind(this),this._onMouseWheel=lA.bind(this),this._onKeyDown=cA.bind(this),this._onTouchStart=hA.bind(this),this._onTouchMove=uA.bind(this),this._onMouseDown=oA.bind(this),this._onMouseMove=aA.bind(this),this._interceptControlDown=fA.bind(this),this._interceptControlUp=pA.bind(this),this.domElement!==null&&this.connect(this.domElement),this.update()}set cursorStyle(t){this._cursorStyle=t,t==="grab"?this.domElement.style.cursor="grab":this.domElement.style.cursor="auto"}get cursorStyle(){return this._cursorStyle}connect(t){super.connect(t),this.domElement.addEventListener("pointerdown",this._onPointerDown),this.domElement.addEventListener("pointercancel",this._onPointerUp),this.domElement.addEventListener("contextmenu",this._onContextMenu),this.domElement.addEventListener("wheel",this._onMouseWheel,{passive:!1}),this.domElement.ownerDocument.addEventListener("keydown",this._interceptControlDown,{passive:!0,capture:!0}),this.domElement.style.touchAction="none"}disconnect(){this.state=Ce.NONE,this.domElement.removeEventListener("pointerdown",this._onPointerDown),this.domElement.ownerDocument.removeEventListener("pointermove",this._onPointerMove),this.domElement.ownerDocument.removeEventListener("pointerup",this._onPointerUp),this.domElement.removeEventListener("pointercancel",this._onPointerUp),this.domElement.removeEventListener("wheel",this._onMouseWheel),this.domElement.removeEventListener("contextmenu",this._onContextMenu),this.stopListenToKeyEvents(),this.domElement.ownerDocument.removeEventListener("keydown",this._interceptControlDown,{capture:!0}),this.domElement.ownerDocument.removeEventListener("keyup",this._interceptControlUp,{capture:!0}),this._controlActive=!1,this._pointers.length=0,this._pointerPositions={},this.domElement.style.touchAction="",this.domElement.style.cursor="auto"}dispose(){this.disconnect()}getPolarAngle(){return this._spherical.phi}getAzimuthalAngle(){return this._spherical.theta}getDistance(){return this.object.position.distanceTo(this.target)}listenToKeyEvents(t){t.addEventListener("keydown",this._onKeyDown),this._domElementKeyEvents=t}stopListenToKeyEvents(){this._domElementKeyEvents!==null&&(this._domElementKeyEvents.removeEventListener("keydown",this._onKeyDown),this._domElementKeyEvents=null)}saveState(){this.target0.copy(this.target),this.position0.copy(this.object.position),this.zoom0=this.object.zoom}reset(){this.target.copy(this.target0),this.object.position.copy(this.position0),this.object.zoom=this.zoom0,this.object.updateProjectionMatrix(),this.dispatchEvent(r_),this.update(),this.state=Ce.NONE}pan(t,e){this._pan(t,e),this.update()}dollyIn(t){this._dollyIn(t),this.update()}dollyOut(t){this._dollyOut(t),this.update()}rotateLeft(t){this._rotateLeft(t),this.update()}rotateUp(t){this._rotateUp(t),this.update()}update(t=null){let e=this.object.position;An.copy(e).sub(this.target),An.applyQuaternion(this._quat),this._spherical.setFromVector3(An),this.autoRotate&&this.state===Ce.NONE&&this._rotateLeft(this._getAutoRotationAngle(t)),this.enableDamping?(this._spherical.theta+=this._sphericalDelta.theta*this.dampingFactor,this._spherical.phi+=this._sphericalDelta.phi*this.dampingFactor):(this._spherical.theta+=this._sphericalDelta.theta,this._spherical.phi+=this._sphericalDelta.phi);let n=this.minAzimuthAngle,s=this.maxAzimuthAngle;isFinite(n)&&isFinite(s)&&(n<-Math.PI?n+=li:n>Math.PI&&(n-=li),s<-Math.PI?s+=li:s>Math.PI&&(s-=li),n<=s?this._spherical.theta=Math.max(n,Math.min(s,this._spherical.theta)):this._spherical.theta=this._spherical.theta>(n+s)/2?Math.max(n,this._spherical.theta):Math.min(s,this._spherical.theta)),this._spherical.phi=Math.max(this.minPolarAngle,Math.min(this.maxPolarAngle,this._spherical.phi)),this._spherical.makeSafe(),this.enableDamping===!0?this.target.addScaledVector(this._panOffset,this.dampingFactor):this.target.add(this._panOffset),this.target.sub(this.cursor),this.target.clampLength(this.minTargetRadius,this.maxTargetRadius),this.target.add(this.cursor);let r=!1;if(this.zoomToCursor&&this._performCursorZoom||this.object.isOrthographicCamera)this._spherical.radius=this._clampDistance(this._spherical.radius);else{let o=this._spherical.radius;this._spherical.radius=this._clampDistance(this._spherical.radius*this._scale),r=o!=this._spherical.radius}if(An.setFromSpherical(this._spherical),An.applyQuaternion(this._quatInverse),e.copy(this.target).add(An),this.object.lookAt(this.target),this.enableDamping===!0?(this._sphericalDelta.theta*=1-this.dampingFactor,this._sphericalDelta.phi*=1-this.dampingFactor,this._panOffset.multiplyScalar(1-this.dampingFactor)):(this._sphericalDelta.set(0,0,0),this._panOffset.set(0,0,0)),this.zoomToCursor&&this._performCursorZoom){let o=null;if(this.object.isPerspectiveCamera){let a=An.length();o=this._clampDistance(a*this._scale);let l=a-o;this.object.position.addScaledVector(this._dollyDirection,l),this.object.updateMatrixWorld(),r=!!l}else if(this.object.isOrthographicCamera){let a=new k(this._mouse.x,this._mouse.y,0);a.unproject(this.object);let l=this.object.zoom;this.object.zoom=Math.max(this.minZoom,Math.min(this.maxZoom,this.object.zoom/this._scale)),this.object.updateProjectionMatrix(),r=l!==this.object.zoom;let c=new k(this._mouse.x,this._mouse.y,0);c.unproject(this.object),this.object.position.sub(c).add(a),this.object.updateMatrixWorld(),o=An.length()}else console.warn("WARNING: OrbitControls.js encountered an unknown camera type - zoom to cursor disabled."),this.zoomToCursor=!1;o!==null&&(this.screenSpacePanning?this.target.set(0,0,-1).transformDirection(this.object.matrix).multiplyScalar(o).add(this.object.position):(Qh.origin.copy(this.object.position),Qh.direction.set(0,0,-1).transformDirection(this.object.matrix),Math.abs(this.object.up.dot(Qh.direction))<nA?this.object.lookAt(this.target):(o_.setFromNormalAndCoplanarPoint(this.object.up,this.target),Qh.intersectPlane(o_,this.target))))}else if(this.object.isOrthographicCamera){let o=this.object.zoom;this.object.zoom=Math.max(this.minZoom,Math.min(this.maxZoom,this.object.zoom/this._scale)),o!==this.object.zoom&&(this.object.updateProjectionMatrix(),r=!0)}return this._scale=1,this._performCursorZoom=!1,r||this._lastPosition.distanceToSquared(this.object.position)>Of||8*(1-this._lastQuaternion.dot(this.object.quaternion))>Of||this._lastTargetPosition.distanceToSquared(this.target)>Of?(this.dispatchEvent(r_),this._lastPosition.copy(this.object.position),this._lastQuaternion.copy(this.object.quaternion),this._lastTargetPosition.copy(this.target),!0):!1}_getAutoRotationAngle(t){return t!==null?li/60*this.autoRotateSpeed*t:li/60/60*this.autoRotateSpeed}_getZoomScale(t){let e=Math.abs(t*.01);return Math.pow(.95,this.zoomSpeed*e)}_rotateLeft(t){this._sphericalDelta.theta-=t}_rotateUp(t){this._sphericalDelta.phi-=t}_panLeft(t,e){An.setFromMatrixColumn(e,0),An.multiplyScalar(-t),this._panOffset.add(An)}_panUp(t,e){this.screenSpacePanning===!0?An.setFromMatrixColumn(e,1):(An.setFromMatrixColumn(e,0),An.crossVectors(this.object.up,An)),An.multiplyScalar(t),this._panOffset.add(An)}_pan(t,e){let n=this.domElement;if(this.object.isPerspectiveCamera){let s=this.object.position;An.copy(s).sub(this.target);let r=An.length();r*=Math.tan(this.object.fov/2*Math.PI/180),this._panLeft(2*t*r/n.clientHeight,this.object.matrix),this._panUp(2*e*r/n.clientHeight,this.object.matrix)}else this.object.isOrthographicCamera?(this._panLeft(t*(this.object.right-this.object.left)/this.object.zoom/n.clientWidth,this.object.matrix),this._panUp(e*(this.object.top-this.object.bottom)/this.object.zoom/n.clientHeight,this.object.matrix)):(console.warn("WARNING: OrbitControls.js encountered an unknown camera type - pan disabled."),this.enablePan=!1)}_dollyOut(t){this.object.isPerspectiveCamera||this.object.isOrthographicCamera?this._scale/=t:(console.warn("WARNING: OrbitControls.js encountered an unknown camera type - dolly/zoom disabled."),this.enableZoom=!1)}_dollyIn(t){this.object.isPerspectiveCamera||this.object.isOrthographicCamera?this._scale*=t:(console.warn("WARNING: OrbitControls.js encountered an unknown camera type - dolly/zoom disabled."),this.enableZoom=!1)}_updateZoomParameters(t,e){if(!this.zoomToCursor)return;this._performCursorZoom=!0;let n=this.domElement.getBoundingClientRect(),s=t-n.left,r=e-n.top,o=n.width,a=n.height;this._mouse.x=s/o*2-1,this._mouse.y=-(r/a)*2+1,this._dollyDirection.set(this._mouse.x,this._mouse.y,1).unproject(this.object).sub(this.object.position).normalize()}_clampDistance(t){return Math.max(this.minDistance,Math.min(this.maxDistance,t))}_handleMouseDownRotate(t){this._rotateStart.set(t.clientX,t.clientY)}_handleMouseDownDolly(t){this._updateZoomParameters(t.clientX,t.clientY),this._dollyStart.set(t.clientX,t.clientY)}_handleMouseDownPan(t){this._panStart.set(t.clientX,t.clientY)}_handleMouseMoveRotate(t){this._rotateEnd.set(t.clientX,t.clientY),this._rotateDelta.subVectors(this._rotateEnd,this._rotateStart).multiplyScalar(this.rotateSpeed);let e=this.domElement;this._rotateLeft(li*this._rotateDelta.x/e.clientHeight),this._rotateUp(li*this._rotateDelta.y/e.clientHeight),this._rotateStart.copy(this._rotateEnd),this.update()}_handleMouseMoveDolly(t){this._dollyEnd.set(t.clientX,t.clientY),this._dollyDelta.subVectors(this._dollyEnd,this._dollyStart),this._dollyDelta.y>0?this._dollyOut(this._getZoomScale(this._dollyDelta.y)):this._dollyDelta.y<0&&this._dollyIn(this._getZoomScale(this._dollyDelta.y)),this._dollyStart.copy(this._dollyEnd),this.zoomToCursor&&(this._performCursorZoom=!0,this._dollyDirection.set(this._mouse.x,this._mouse.y,1).unproject(this.object).sub(this.object.position).normalize()),this.update()}_handleMouseMovePan(t){this._panEnd.set(t.clientX,t.clientY),this._panDelta.subVectors(this._panEnd,this._panStart).multiplyScalar(this.panSpeed),this._pan(this._panDelta.x,this._panDelta.y),this._panStart.copy(this._panEnd),this.update()}_handleMouseWheel(t){this._updateZoomParameters(t.clientX,t.clientY),t.deltaY<0?this._dollyIn(this._getZoomScale(t.deltaY)):t.deltaY>0&&this._dollyOut(this._getZoomScale(t.deltaY)),this.update()}_handleKeyDown(t){let e=!1;switch(t.code){case this.keys.UP:t.ctrlKey||t.metaKey||t.shiftKey?this.enableRotate&&this._rotateUp(li*this.keyRotateSpeed/this.domElement.clientHeight):this.enablePan&&this._pan(0,this.keyPanSpeed),e=!0;break;case this.keys.BOTTOM:t.ctrlKey||t.metaKey||t.shiftKey?this.enableRotate&&this._rotateUp(-li*this.keyRotateSpeed/this.domElement.clientHeight):this.enablePan&&this._pan(0,-this.keyPanSpeed),e=!0;break;case this.keys.LEFT:t.ctrlKey||t.metaKey||t.shiftKey?this.enableRotate&&this._rotateLeft(li*this.keyRotateSpeed/this.domElement.clientHeight):this.enablePan&&this._pan(this.keyPanSpeed,0),e=!0;break;case this.keys.RIGHT:t.ctrlKey||t.metaKey||t.shiftKey?this.enableRotate&&this._rotateLeft(-li*this.keyRotateSpeed/this.domElement.clientHeight):this.enablePan&&this._pan(-this.keyPanSpeed,0),e=!0;break}e&&(t.preventDefault(),this.update())}_handleTouchStartRotate(t){if(this._pointers.length===1)this._rotateStart.set(t.pageX,t.pageY);else{let e=this._getSecondPointerPosition(t),n=.5*(t.pageX+e.x),s=.5*(t.pageY+e.y);this._rotateStart.set(n,s)}}_handleTouchStartPan(t){if(this._pointers.length===1)this._panStart.set(t.pageX,t.pageY);else{let e=this._getSecondPointerPosition(t),n=.5*(t.pageX+e.x),s=.5*(t.pageY+e.y);this._panStart.set(n,s)}}_handleTouchStartDolly(t){let e=this._getSecondPointerPosition(t),n=t.pageX-e.x,s=t.pageY-e.y,r=Math.sqrt(n*n+s*s);this._dollyStart.set(0,r)}_handleTouchStartDollyPan(t){this.enableZoom&&this._handleTouchStartDolly(t),this.enablePan&&this._handleTouchStartPan(t)}_handleTouchStartDollyRotate(t){this.enableZoom&&this._handleTouchStartDolly(t),this.enableRotate&&this._handleTouchStartRotate(t)}_handleTouchMoveRotate(t){if(this._pointers.length==1)this._rotateEnd.set(t.pageX,t.pageY);else{let n=this._getSecondPointerPosition(t),s=.5*(t.pageX+n.x),r=.5*(t.pageY+n.y);this._rotateEnd.set(s,r)}this._rotateDelta.subVectors(this._rotateEnd,this._rotateStart).multiplyScalar(this.rotateSpeed);let e=this.domElement;this._rotateLeft(li*this._rotateDelta.x/e.clientHeight),this._rotateUp(li*this._rotateDelta.y/e.clientHeight),this._rotateStart.copy(this._rotateEnd)}_handleTouchMovePan(t){if(this._pointers.length===1)this._panEnd.set(t.pageX,t.pageY);else{let e=this._getSecondPointerPosition(t),n=.5*(t.pageX+e.x),s=.5*(t.pageY+e.y);this._panEnd.set(n,s)}this._panDelta.subVectors(this._panEnd,this._panStart).multiplyScalar(this.panSpeed),this._pan(this._panDelta.x,this._panDelta.y),this._panStart.copy(this._panEnd)}_handleTouchMoveDolly(t){let e=this._getSecondPointerPosition(t),n=t.pageX-e.x,s=t.pageY-e.y,r=Math.sqrt(n*n+s*s);this._dollyEnd.set(0,r),this._dollyDelta.set(0,Math.pow(this._dollyEnd.y/this._dollyStart.y,this.zoomSpeed)),this._dollyOut(this._dollyDelta.y),this._dollyStart.copy(this._dollyEnd);let o=(t.pageX+e.x)*.5,a=(t.pageY+e.y)*.5;this._updateZoomParameters(o,a)}_handleTouchMoveDollyPan(t){this.enableZoom&&this._handleTouchMoveDolly(t),this.enablePan&&this._handleTouchMovePan(t)}_handleTouchMoveDollyRotate(t){this.enableZoom&&this._handleTouchMoveDolly(t),this.enableRotate&&this._handleTouchMoveRotate(t)}_addPointer(t){this._pointers.push(t.pointerId)}_removePointer(t){delete this._pointerPositions[t.pointerId];for(let e=0;e<this._pointers.length;e++)if(this._pointers[e]==t.pointerId){this._pointers.splice(e,1);return}}_isTrackingPointer(t){for(let e=0;e<this._pointers.length;e++)if(this._pointers[e]==t.pointerId)return!0;return!1}_trackPointer(t){let e=this._pointerPositions[t.pointerId];e===void 0&&(e=new Zt,this._pointerPositions[t.pointerId]=e),e.set(t.pageX,t.pageY)}_getSecondPointerPosition(t){let e=t.pointerId===this._pointers[0]?this._pointers[1]:this._pointers[0];return this._pointerPositions[e]}_customWheelEvent(t){let e=t.deltaMode,n={clientX:t.clientX,clientY:t.clientY,deltaY:t.deltaY};switch(e){case 1:n.deltaY*=16;break;case 2:n.deltaY*=100;break}return t.ctrlKey&&!this._controlActive&&(n.deltaY*=10),n}};function iA(i){this.enabled!==!1&&(this._pointers.length===0&&(this.domElement.setPointerCapture(i.pointerId),this.domElement.ownerDocument.addEventListener("pointermove",this._onPointerMove),this.domElement.ownerDocument.addEventListener("pointerup",this._onPointerUp)),!this._isTrackingPointer(i)&&(this._addPointer(i),i.pointerType==="touch"?this._onTouchStart(i):this._onMouseDown(i),this._cursorStyle==="grab"&&(this.domElement.style.cursor="grabbing")))}function sA(i){this.enabled!==!1&&(i.pointerType==="touch"?this._onTouchMove(i):this._onMouseMove(i))}function rA(i){switch(this._removePointer(i),this._pointers.length){case 0:this.domElement.releasePointerCapture(i.pointerId),this.domElement.ownerDocument.removeEventListener("pointermove",this._onPointerMove),this.domElement.ownerDocument.removeEventListener("pointerup",this._onPointerUp),this.dispatchEvent(a_),this.state=Ce.NONE,this._cursorStyle==="grab"&&(this.domElement.style.cursor="grab");break;case 1:let t=this._pointers[0],e=this._pointerPositions[t];this._onTouchStart({pointerId:t,pageX:e.x,pageY:e.y});break}}function oA(i){let t;switch(i.button){case 0:t=this.mouseButtons.LEFT;break;case 1:t=this.mouseButtons.MIDDLE;break;case 2:t=this.mouseButtons.RIGHT;break;default:t=-1}switch(t){case or.DOLLY:if(this.enableZoom===!1)return;this._handleMouseDownDolly(i),this.state=Ce.DOLLY;break;case or.ROTATE:if(i.ctrlKey||i.metaKey||i.shiftKey){if(this.enablePan===!1)return;this._handleMouseDownPan(i),this.state=Ce.PAN}else{if(this.enableRotate===!1)return;this._handleMouseDownRotate(i),this.state=Ce.ROTATE}break;case or.PAN:if(i.ctrlKey||i.metaKey||i.shiftKey){if(this.enableRotate===!1)return;this._handleMouseDownRotate(i),this.state=Ce.ROTATE}else{if(this.enablePan===!1)return;this._handleMouseDownPan(i),this.state=Ce.PAN}break;default:this.state=Ce.NONE}this.state!==Ce.NONE&&this.dispatchEvent(Ff)}function aA(i){switch(this.state){case Ce.ROTATE:if(this.enableRotate===!1)return;this._handleMouseMoveRotate(i);break;case Ce.DOLLY:if(this.enableZoom===!1)return;this._handleMouseMoveDolly(i);break;case Ce.PAN:if(this.enablePan===!1)return;this._handleMouseMovePan(i);break}}function lA(i){this.enabled===!1||this.enableZoom===!1||this.state!==Ce.NONE||(i.preventDefault(),this.dispatchEvent(Ff),this._handleMouseWheel(this._customWheelEvent(i)),this.dispatchEvent(a_))}function cA(i){this.enabled!==!1&&this._handleKeyDown(i)}function hA(i){switch(this._trackPointer(i),this._pointers.length){case 1:switch(this.touches.ONE){case ar.ROTATE:if(this.enableRotate===!1){this.state=Ce.NONE;break}this._handleTouchStartRotate(i),this.state=Ce.TOUCH_ROTATE;break;case ar.PAN:if(this.enablePan===!1){this.state=Ce.NONE;break}this._handleTouchStartPan(i),this.state=Ce.TOUCH_PAN;break;default:this.state=Ce.NONE}break;case 2:switch(this.touches.TWO){case ar.DOLLY_PAN:if(this.enableZoom===!1&&this.enablePan===!1)return;this._handleTouchStartDollyPan(i),this.state=Ce.TOUCH_DOLLY_PAN;break;case ar.DOLLY_ROTATE:if(this.enableZoom===!1&&this.enableRotate===!1)return;this._handleTouchStartDollyRotate(i),this.state=Ce.TOUCH_DOLLY_ROTATE;break;default:this.state=Ce.NONE}break;default:this.state=Ce.NONE}this.state!==Ce.NONE&&this.dispatchEvent(Ff)}function uA(i){switch(this._trackPointer(i),this.state){case Ce.TOUCH_ROTATE:if(this.enableRotate===!1)return;this._handleTouchMoveRotate(i),this.update();break;case Ce.TOUCH_PAN:if(this.enablePan===!1)return;this._handleTouchMovePan(i),this.update();break;case Ce.TOUCH_DOLLY_PAN:if(this.enableZoom===!1&&this.enablePan===!1)return;this._handleTouchMoveDollyPan(i),this.update();break;case Ce.TOUCH_DOLLY_ROTATE:if(this.enableZoom===!1&&this.enableRotate===!1)return;this._handleTouchMoveDollyRotate(i),this.update();break;default:this.state=Ce.NONE}}function dA(i){this.enabled!==!1&&i.preventDefault()}function fA(i){i.key==="Control"&&(this._controlActive=!0,this.domElement.ownerDocument.addEventListener("keyup",this._interceptControlUp,{passive:!0,capture:!0}))}function pA(i){i.key==="Control"&&(this._controlActive=!1,this.domElement.ownerDocument.removeEventListener("keyup",this._interceptControlUp,{passive:!0,capture:!0}))}var l_=new yi,eu=new k,na=class extends za{constructor(){super(),this.isLineSegmentsGeometry=!0,this.type="LineSegmentsGeometry";let t=[-1,2,0,1,2,0,-1,1,0,1,1,0,-1,0,0,1,0,0,-1,-1,0,1,-1,0],e=[-1,2,1,2,-1,1,1,1,-1,-1,1,-1,-1,-2,1,-2],n=[0,2,1,2,3,1,2,4,3,4,5,3,4,6,5,6,7,5];this.setIndex(n),this.setAttribute("position",new sn(t,3)),this.setAttribute("uv",new sn(e,2))}applyMatrix4(t){let e=this.attributes.instanceStart,n=this.attributes.instanceEnd;return e!==void 0&&(e.applyMatrix4(t),n.applyMatrix4(t),e.needsUpdate=!0),this.boundingBox!==null&&this.computeBoundingBox(),this.boundingSphere!==null&&this.computeBoundingSphere(),this}setPositions(t){let e;t instanceof Float32Array?e=t:Array.isArray(t)&&(e=new Float32Array(t));let n=new rr(e,6,1);return this.setAttribute("instanceStart",new Vi(n,3,0)),this.setAttribute("instanceEnd",new Vi(n,3,3)),this.instanceCount=this.attributes.instanceStart.count,this.computeBoundingBox(),this.computeBoundingSphere(),this}setColors(t){let e;t instanceof Float32Array?e=t:Array.isArray(t)&&(e=new Float32Array(t));let n=new rr(e,6,1);return this.setAttribute("instanceColorStart",new Vi(n,3,0)),this.setAttribute("instanceColorEnd",new Vi(n,3,3)),this}fromWireframeGeometry(t){return this.setPositions(t.attributes.position.array),this}fromEdgesGeometry(t){return this.setPositions(t.attributes.position.array),this}fromMesh(t){return this.fromWireframeGeometry(new Da(t.geometry)),this}fromLineSegments(t){let e=t.geometry;return this.setPositions(e.attributes.position.array),this}computeBoundingBox(){this.boundingBox===null&&(this.boundingBox=new yi);let t=this.attributes.instanceStart,e=this.attributes.instanceEnd;t!==void 0&&e!==void 0&&(this.boundingBox.setFromBufferAttribute(t),l_.setFromBufferAttribute(e),this.boundingBox.union(l_))}computeBoundingSphere(){this.boundingSphere===null&&(this.boundingSphere=new Ci),this.boundingBox===null&&this.computeBoundingBox();let t=this.attributes.instanceStart,e=this.attributes.instanceEnd;if(t!==void 0&&e!==void 0){let n=this.boundingSphere.center;this.boundingBox.getCenter(n);let s=0;for(let r=0,o=t.count;r<o;r++)eu.fromBufferAttribute(t,r),s=Math.max(s,n.distanceToSquared(eu)),eu.fromBufferAttribute(e,r),s=Math.max(s,n.distanceToSquared(eu));this.boundingSphere.radius=Math.sqrt(s),isNaN(this.boundingSphere.radius)&&console.error("THREE.LineSegmentsGeometry.computeBoundingSphere(): Computed radius is NaN. The instanced position data is likely to have NaN values.",this)}}toJSON(){}};Pt.line={worldUnits:{value:1},linewidth:{value:1},resolution:{value:new Zt},dashOffset:{value:0},dashScale:{value:1},dashSize:{value:1},gapSize:{value:1}};ii.line={uniforms:Qa.merge([Pt.common,Pt.fog,Pt.line]),vertexShader:`
		#include <common>
		#include <color_pars_vertex>
		#include <fog_pars_vertex>
		#include <logdepthbuf_pars_vertex>
		#include <clipping_planes_pars_vertex>

		uniform float linewidth;
		uniform vec2 resolution;

		attribute vec3 instanceStart;
		attribute vec3 instanceEnd;

		attribute vec3 instanceColorStart;
		attribute vec3 instanceColorEnd;

		#ifdef WORLD_UNITS

			varying vec4 worldPos;
			varying vec3 worldStart;
			varying vec3 worldEnd;

			#ifdef USE_DASH

				varying vec2 vUv;

			#endif

		#else

			varying vec2 vUv;

		#endif

		#ifdef USE_DASH

			uniform float dashScale;
			attribute float instanceDistanceStart;
			attribute float instanceDistanceEnd;
			varying float vLineDistance;

		#endif

		float trimSegmentAlpha( const in vec4 start, const in vec4 end ) {

			// compute the interpolation factor needed to trim the segment so it terminates
			// between the camera plane and the near plane

			// conservative estimate of the near plane
			float a = projectionMatrix[ 2 ][ 2 ]; // 3nd entry in 3th column
			float b = projectionMatrix[ 3 ][ 2 ]; // 3nd entry in 4th column

			// we need different nearEstimate formula for reversed and default depth buffer
			// a is positive with a reversed depth buffer so it can be used for controlling the code flow
			float nearEstimate = ( a > 0.0 ) ? ( - b / ( a + 1.0 ) ) : ( - 0.5 * b / a );

			return ( nearEstimate - start.z ) / ( end.z - start.z );

		}

		void main() {

			#ifdef USE_COLOR

				vColor.xyz = ( position.y < 0.5 ) ? instanceColorStart : instanceColorEnd;

			#endif

			float aspect = resolution.x / resolution.y;

			// camera space
			vec4 start = modelViewMatrix * vec4( instanceStart, 1.0 );
			vec4 end = modelViewMatrix * vec4( instanceEnd, 1.0 );

			#ifdef USE_DASH

				float lineDistanceStart = dashScale * instanceDistanceStart;
				float lineDistanceEnd = dashScale * instanceDistanceEnd;

			#endif

			#ifdef WORLD_UNITS

				worldStart = start.xyz;
				worldEnd = end.xyz;

			#else

				vUv = uv;

			#endif

			// special case for perspective projection, and segments that terminate either in, or behind, the camera plane
			// clearly the gpu firmware has a way of addressing this issue when projecting into ndc space
			// but we need to perform ndc-space calculations in the shader, so we must address this issue directly
			// perhaps there is a more elegant solution -- WestLangley

			bool perspective = ( projectionMatrix[ 2 ][ 3 ] == - 1.0 ); // 4th entry in the 3rd column

			if ( perspective ) {

				if ( start.z < 0.0 && end.z >= 0.0 ) {

					float alpha = trimSegmentAlpha( start, end );
					end.xyz = mix( start.xyz, end.xyz, alpha );

					#ifdef USE_DASH

						lineDistanceEnd = mix( lineDistanceStart, lineDistanceEnd, alpha );

					#endif

				} else if ( end.z < 0.0 && start.z >= 0.0 ) {

					float alpha = trimSegmentAlpha( end, start );
					start.xyz = mix( end.xyz, start.xyz, alpha );

					#ifdef USE_DASH

						lineDistanceStart = mix( lineDistanceEnd, lineDistanceStart, alpha );

					#endif

				}

			}

			#ifdef USE_DASH

				vLineDistance = ( position.y < 0.5 ) ? lineDistanceStart : lineDistanceEnd;
				vUv = uv;

			#endif

			// clip space
			vec4 clipStart = projectionMatrix * start;
			vec4 clipEnd = projectionMatrix * end;

			// ndc space
			vec3 ndcStart = clipStart.xyz / clipStart.w;
			vec3 ndcEnd = clipEnd.xyz / clipEnd.w;

			// direction
			vec2 dir = ndcEnd.xy - ndcStart.xy;

			// account for clip-space aspect ratio
			dir.x *= aspect;
			dir = normalize( dir );

			#ifdef WORLD_UNITS

				vec3 worldDir = normalize( end.xyz - start.xyz );
				vec3 tmpFwd = perspective ? normalize( mix( start.xyz, end.xyz, 0.5 ) ) : vec3( 0.0, 0.0, - 1.0 );
				vec3 worldUp = normalize( cross( worldDir, tmpFwd ) );
				vec3 worldFwd = cross( worldDir, worldUp );
				worldPos = position.y < 0.5 ? start: end;

				// height offset
				float hw = linewidth * 0.5;
				worldPos.xyz += position.x < 0.0 ? hw * worldUp : - hw * worldUp;

				// don't extend the line if we're rendering dashes because we
				// won't be rendering the endcaps
				#ifndef USE_DASH

					// cap extension
					worldPos.xyz += position.y < 0.5 ? - hw * worldDir : hw * worldDir;

					// add width to the box
					worldPos.xyz += worldFwd * hw;

					// endcaps
					if ( position.y > 1.0 || position.y < 0.0 ) {

						worldPos.xyz -= worldFwd * 2.0 * hw;

					}

				#endif

				// project the worldpos
				vec4 clip = projectionMatrix * worldPos;

				// shift the depth of the projected points so the line
				// segments overlap neatly
				vec3 clipPose = ( position.y < 0.5 ) ? ndcStart : ndcEnd;

				// only shift the depth of vertices in front of the camera (#35137)
				if ( clip.w > 0.0 ) clip.z = clipPose.z * clip.w;

			#else

				vec2 offset = vec2( dir.y, - dir.x );
				// undo aspect ratio adjustment
				dir.x /= aspect;
				offset.x /= aspect;

				// sign flip
				if ( position.x < 0.0 ) offset *= - 1.0;

				// endcaps
				if ( position.y < 0.0 ) {

					offset += - dir;

				} else if ( position.y > 1.0 ) {

					offset += dir;

				}

				// adjust for linewidth
				offset *= linewidth;

				// adjust for clip-space to screen-space conversion // maybe resolution should be based on viewport ...
				offset /= resolution.y;

				// select end
				vec4 clip = ( position.y < 0.5 ) ? clipStart : clipEnd;

				// back to clip space
				offset *= clip.w;

				clip.xy += offset;

			#endif

			gl_Position = clip;

			vec4 mvPosition = ( position.y < 0.5 ) ? start : end; // this is an approximation

			#include <logdepthbuf_vertex>
			#include <clipping_planes_vertex>
			#include <fog_vertex>

		}
		`,fragmentShader:`
		uniform vec3 diffuse;
		uniform float opacity;
		uniform float linewidth;

		#ifdef USE_DASH

			uniform float dashOffset;
			uniform float dashSize;
			uniform float gapSize;

		#endif

		varying float vLineDistance;

		#ifdef WORLD_UNITS

			varying vec4 worldPos;
			varying vec3 worldStart;
			varying vec3 worldEnd;

			#ifdef USE_DASH

				varying vec2 vUv;

			#endif

		#else

			varying vec2 vUv;

		#endif

		#include <common>
		#include <color_pars_fragment>
		#include <fog_pars_fragment>
		#include <logdepthbuf_pars_fragment>
		#include <clipping_planes_pars_fragment>

		vec2 closestLineToLine(vec3 p1, vec3 p2, vec3 p3, vec3 p4) {

			float mua;
			float mub;

			vec3 p13 = p1 - p3;
			vec3 p43 = p4 - p3;

			vec3 p21 = p2 - p1;

			float d1343 = dot( p13, p43 );
			float d4321 = dot( p43, p21 );
			float d1321 = dot( p13, p21 );
			float d4343 = dot( p43, p43 );
			float d2121 = dot( p21, p21 );

			float denom = d2121 * d4343 - d4321 * d4321;

			float numer = d1343 * d4321 - d1321 * d4343;

			mua = numer / denom;
			mua = clamp( mua, 0.0, 1.0 );
			mub = ( d1343 + d4321 * ( mua ) ) / d4343;
			mub = clamp( mub, 0.0, 1.0 );

			return vec2( mua, mub );

		}

		void main() {

			float alpha = opacity;
			vec4 diffuseColor = vec4( diffuse, alpha );

			#include <clipping_planes_fragment>

			#ifdef USE_DASH

				if ( vUv.y < - 1.0 || vUv.y > 1.0 ) discard; // discard endcaps

				if ( mod( vLineDistance + dashOffset, dashSize + gapSize ) > dashSize ) discard; // todo - FIX

			#endif

			#ifdef WORLD_UNITS

				float len;

				if ( isOrthographic ) {

					// View rays are parallel to the z axis so the distance reduces to camera-space XY
					vec2 lineDir = worldEnd.xy - worldStart.xy;
					float t = clamp( dot( worldPos.xy - worldStart.xy, lineDir ) / dot( lineDir, lineDir ), 0.0, 1.0 );
					len = length( worldStart.xy + lineDir * t - worldPos.xy );

				} else {

					// Find the closest points on the view ray and the line segment
					vec3 rayEnd = normalize( worldPos.xyz ) * 1e5;
					vec3 lineDir = worldEnd - worldStart;
					vec2 params = closestLineToLine( worldStart, worldEnd, vec3( 0.0, 0.0, 0.0 ), rayEnd );

					vec3 p1 = worldStart + lineDir * params.x;
					vec3 p2 = rayEnd * params.y;
					vec3 delta = p1 - p2;
					len = length( delta );

				}

				float norm = len / linewidth;

				#ifndef USE_DASH

					#ifdef USE_ALPHA_TO_COVERAGE

						float dnorm = fwidth( norm );
						alpha = 1.0 - smoothstep( 0.5 - dnorm, 0.5 + dnorm, norm );

					#else

						if ( norm > 0.5 ) {

							discard;

						}

					#endif

				#endif

			#else

				#ifdef USE_ALPHA_TO_COVERAGE

					// artifacts appear on some hardware if a derivative is taken within a conditional
					float a = vUv.x;
					float b = ( vUv.y > 0.0 ) ? vUv.y - 1.0 : vUv.y + 1.0;
					float len2 = a * a + b * b;
					float dlen = fwidth( len2 );

					if ( abs( vUv.y ) > 1.0 ) {

						alpha = 1.0 - smoothstep( 1.0 - dlen, 1.0 + dlen, len2 );

					}

				#else

					if ( abs( vUv.y ) > 1.0 ) {

						float a = vUv.x;
						float b = ( vUv.y > 0.0 ) ? vUv.y - 1.0 : vUv.y + 1.0;
						float len2 = a * a + b * b;

						if ( len2 > 1.0 ) discard;

					}

				#endif

			#endif

			#include <logdepthbuf_fragment>
			#include <color_fragment>

			gl_FragColor = vec4( diffuseColor.rgb, alpha );

			#include <tonemapping_fragment>
			#include <colorspace_fragment>
			#include <fog_fragment>
			#include <premultiplied_alpha_fragment>

		}
		`};var zs=class extends Ri{constructor(t){super({type:"LineMaterial",uniforms:Qa.clone(ii.line.uniforms),vertexShader:ii.line.vertexShader,fragmentShader:ii.line.fragmentShader,clipping:!0}),this.isLineMaterial=!0,this.setValues(t)}get color(){return this.uniforms.diffuse.value}set color(t){this.uniforms.diffuse.value=t}get worldUnits(){return"WORLD_UNITS"in this.defines}set worldUnits(t){t===!0!==this.worldUnits&&(this.needsUpdate=!0),t===!0?this.defines.WORLD_UNITS="":delete this.defines.WORLD_UNITS}get linewidth(){return this.uniforms.linewidth.value}set linewidth(t){this.uniforms.linewidth&&(this.uniforms.linewidth.value=t)}get dashed(){return"USE_DASH"in this.defines}set dashed(t){t===!0!==this.dashed&&(this.needsUpdate=!0),t===!0?this.defines.USE_DASH="":delete this.defines.USE_DASH}get dashScale(){return this.uniforms.dashScale.value}set dashScale(t){this.uniforms.dashScale.value=t}get dashSize(){return this.uniforms.dashSize.value}set dashSize(t){this.uniforms.dashSize.value=t}get dashOffset(){return this.uniforms.dashOffset.value}set dashOffset(t){this.uniforms.dashOffset.value=t}get gapSize(){return this.uniforms.gapSize.value}set gapSize(t){this.uniforms.gapSize.value=t}get opacity(){return this.uniforms.opacity.value}set opacity(t){this.uniforms&&(this.uniforms.opacity.value=t)}get resolution(){return this.uniforms.resolution.value}set resolution(t){this.uniforms.resolution.value.copy(t)}get alphaToCoverage(){return"USE_ALPHA_TO_COVERAGE"in this.defines}set alphaToCoverage(t){this.defines&&(t===!0!==this.alphaToCoverage&&(this.needsUpdate=!0),t===!0?this.defines.USE_ALPHA_TO_COVERAGE="":delete this.defines.USE_ALPHA_TO_COVERAGE)}};var Bf=new Ie,c_=new k,h_=new k,Fn=new Ie,Bn=new Ie,ps=new Ie,kf=new k,zf=new be,kn=new Ga,u_=new k,nu=new yi,iu=new Ci,ms=new Ie,gs,Br;function d_(i,t,e){return ms.set(0,0,-t,1).applyMatrix4(i.projectionMatrix),ms.multiplyScalar(1/ms.w),ms.x=Br/e.width,ms.y=Br/e.height,ms.applyMatrix4(i.projectionMatrixInverse),ms.multiplyScalar(1/ms.w),Math.abs(Math.max(ms.x,ms.y))}function mA(i,t){let e=i.matrixWorld,n=i.geometry,s=n.attributes.instanceStart,r=n.attributes.instanceEnd,o=Math.min(n.instanceCount,s.count);for(let a=0,l=o;a<l;a++){kn.start.fromBufferAttribute(s,a),kn.end.fromBufferAttribute(r,a),kn.applyMatrix4(e);let c=new k,u=new k;gs.distanceSqToSegment(kn.start,kn.end,u,c),u.distanceTo(c)<Br*.5&&t.push({point:u,pointOnLine:c,distance:gs.origin.distanceTo(u),object:i,face:null,faceIndex:a,uv:null,uv1:null})}}function gA(i,t,e){let n=t.projectionMatrix,r=i.material.resolution,o=i.matrixWorld,a=i.geometry,l=a.attributes.instanceStart,c=a.attributes.instanceEnd,u=Math.min(a.instanceCount,l.count),h=-t.near;gs.at(1,ps),ps.w=1,ps.applyMatrix4(t.matrixWorldInverse),ps.applyMatrix4(n),ps.multiplyScalar(1/ps.w),ps.x*=r.x/2,ps.y*=r.y/2,ps.z=0,kf.copy(ps),zf.multiplyMatrices(t.matrixWorldInverse,o);for(let d=0,f=u;d<f;d++){if(Fn.fromBufferAttribute(l,d),Bn.fromBufferAttribute(c,d),Fn.w=1,Bn.w=1,Fn.applyMatrix4(zf),Bn.applyMatrix4(zf),Fn.z>h&&Bn.z>h)continue;if(Fn.z>h){let E=Fn.z-Bn.z,b=(Fn.z-h)/E;Fn.lerp(Bn,b)}else if(Bn.z>h){let E=Bn.z-Fn.z,b=(Bn.z-h)/E;Bn.lerp(Fn,b)}Fn.applyMatrix4(n),Bn.applyMatrix4(n),Fn.multiplyScalar(1/Fn.w),Bn.multiplyScalar(1/Bn.w),Fn.x*=r.x/2,Fn.y*=r.y/2,Bn.x*=r.x/2,Bn.y*=r.y/2,kn.start.copy(Fn),kn.start.z=0,kn.end.copy(Bn),kn.end.z=0;let y=kn.closestPointToPointParameter(kf,!0);kn.at(y,u_);let p=ja.lerp(Fn.z,Bn.z,y),g=p>=-1&&p<=1,v=kf.distanceTo(u_)<Br*.5;if(g&&v){kn.start.fromBufferAttribute(l,d),kn.end.fromBufferAttribute(c,d),kn.start.applyMatrix4(o),kn.end.applyMatrix4(o);let E=new k,b=new k;gs.distanceSqToSegment(kn.start,kn.end,b,E),e.push({point:b,pointOnLine:E,distance:gs.origin.distanceTo(b),object:i,face:null,faceIndex:d,uv:null,uv1:null})}}}var su=class extends Sn{constructor(t=new na,e=new zs({color:Math.random()*16777215})){super(t,e),this.isLineSegments2=!0,this.type="LineSegments2"}computeLineDistances(){let t=this.geometry,e=t.attributes.instanceStart,n=t.attributes.instanceEnd,s=new Float32Array(2*e.count);for(let o=0,a=0,l=e.count;o<l;o++,a+=2)c_.fromBufferAttribute(e,o),h_.fromBufferAttribute(n,o),s[a]=a===0?0:s[a-1],s[a+1]=s[a]+c_.distanceTo(h_);let r=new rr(s,2,1);return t.setAttribute("instanceDistanceStart",new Vi(r,1,0)),t.setAttribute("instanceDistanceEnd",new Vi(r,1,1)),this}raycast(t,e){let n=this.material.worldUnits,s=t.camera;if(s===null&&!n&&console.error('LineSegments2: "Raycaster.camera" needs to be set in order to raycast against LineSegments2 while worldUnits is set to false.'),n===!1&&(this.material.resolution.x===0||this.material.resolution.y===0))return;let r=t.params.Line2!==void 0&&t.params.Line2.threshold||0;gs=t.ray;let o=this.matrixWorld,a=this.geometry,l=this.material;Br=l.linewidth+r,a.boundingSphere===null&&a.computeBoundingSphere(),iu.copy(a.boundingSphere).applyMatrix4(o);let c;if(n)c=Br*.5;else{let h=Math.max(s.near,iu.distanceToPoint(gs.origin));c=d_(s,h,l.resolution)}if(iu.radius+=c,gs.intersectsSphere(iu)===!1)return;a.boundingBox===null&&a.computeBoundingBox(),nu.copy(a.boundingBox).applyMatrix4(o);let u;if(n)u=Br*.5;else{let h=Math.max(s.near,nu.distanceToPoint(gs.origin));u=d_(s,h,l.resolution)}nu.expandByScalar(u),gs.intersectsBox(nu)!==!1&&(n?mA(this,e):gA(this,s,e))}onBeforeRender(t){let e=this.material.uniforms;e&&e.resolution&&(t.getViewport(Bf),this.material.uniforms.resolution.value.set(Bf.z,Bf.w))}};var kr=class extends na{constructor(){super(),this.isLineGeometry=!0,this.type="LineGeometry"}setPositions(t){let e=t.length-3,n=new Float32Array(2*e);for(let s=0;s<e;s+=3)n[2*s]=t[s],n[2*s+1]=t[s+1],n[2*s+2]=t[s+2],n[2*s+3]=t[s+3],n[2*s+4]=t[s+4],n[2*s+5]=t[s+5];return super.setPositions(n),this}setColors(t){let e=t.length-3,n=new Float32Array(2*e);for(let s=0;s<e;s+=3)n[2*s]=t[s],n[2*s+1]=t[s+1],n[2*s+2]=t[s+2],n[2*s+3]=t[s+3],n[2*s+4]=t[s+4],n[2*s+5]=t[s+5];return super.setColors(n),this}setFromPoints(t){let e=t.length-1,n=new Float32Array(6*e);for(let s=0;s<e;s++)n[6*s]=t[s].x,n[6*s+1]=t[s].y,n[6*s+2]=t[s].z||0,n[6*s+3]=t[s+1].x,n[6*s+4]=t[s+1].y,n[6*s+5]=t[s+1].z||0;return super.setPositions(n),this}fromLine(t){let e=t.geometry;return this.setPositions(e.attributes.position.array),this}};var yl=class extends su{constructor(t=new kr,e=new zs({color:Math.random()*16777215})){super(t,e),this.isLine2=!0,this.type="Line2"}};var Vs=([i,t,e])=>new he(`rgb(${i},${t},${e})`),Gf=[240,228,66],Hf=[213,94,0],Vf=new Set(["road","verge","ground","terrain","lane_line"]);function _A(){let i=document.createElement("canvas");i.width=i.height=64;let t=i.getContext("2d");for(let[e,n]of[["#666",30],["#fff",23]])t.fillStyle=e,t.beginPath(),t.arc(32,32,n,0,2*Math.PI),t.fill();return new Lo(i)}var Li=class{constructor({pick:t}){this.box=F("div",{class:"scene",tabIndex:0}),this.pick=t,this.key=F("div",{class:"materials",hidden:!0}),this.box.append(this.key);try{this.renderer=new Lh({antialias:!0,preserveDrawingBuffer:!0})}catch{this.box.append(F("p",{class:"missing"},"The browser gives no WebGL, so the scene is not drawn. Maps, plots and tables are all there."));return}this.box.append(this.renderer.domElement),this.scene=new Ea,this.camera=new Qn(50,1,.1,5e3),this.camera.up.set(0,0,1),this.scene.add(new ka(16777215,1.6));let e=new Ba(16777215,1.8);e.position.set(-30,40,80),this.scene.add(e),this.controls=new tu(this.camera,this.renderer.domElement),this.controls.addEventListener("change",()=>this.draw()),this.controls.maxPolarAngle=.499*Math.PI,this.layers=Object.fromEntries(["bodies","boxes","mask","lanes","estimates","field","ego","tracks","points","chosen","paths"].map(s=>[s,new Cs])),this.scene.add(...Object.values(this.layers)),this.texture=_A(),new ResizeObserver(()=>this.size()).observe(this.box);let n=this.renderer.domElement;n.addEventListener("pointerdown",s=>this.down=[s.clientX,s.clientY]),n.addEventListener("pointerup",s=>{this.down&&Math.hypot(s.clientX-this.down[0],s.clientY-this.down[1])<4&&this.click(s)}),this.theme()}theme(){this.renderer&&(this.scene.background=new he(Zn("sky")),this.draw())}size(){let{clientWidth:t,clientHeight:e}=this.box;!t||!e||!this.renderer||(this.renderer.setPixelRatio(Math.min(2,window.devicePixelRatio||1)),this.renderer.setSize(t,e),this.camera.aspect=t/e,this.camera.updateProjectionMatrix(),this.draw())}draw(){!this.renderer||this.asked||(this.asked=!0,requestAnimationFrame(()=>{this.asked=!1,this.renderer.render(this.scene,this.camera),this.drawn=(this.drawn??0)+1}))}set(t){if(!this.renderer||!t)return;let e=t.meshes.map(n=>{let s=new gn;s.setAttribute("position",new vn(Vn(n.positions),3)),s.setIndex(new vn(Vn(n.triangles),1));let r=0;return n.materials.forEach(([o,a])=>{s.addGroup(3*r,3*a,o),r+=a}),s});this.bodies=t.objects.map(n=>{let s=Vn(n.poses),r;if("mesh"in n.shape){let o=t.materials.map(a=>new Ns({color:Vs(Pr(a,n.class)),side:ri,flatShading:!0,transparent:!n.radar,opacity:n.radar?1:.35,polygonOffset:Vf.has(n.class),polygonOffsetFactor:1,polygonOffsetUnits:1}));r=new Sn(e[n.shape.mesh],o.length?o:new Ns)}else r=new Sn(new No(.15,12,8),new Ns({color:Vs(qi(n.class))}));return r.userData=n,this.layers.bodies.add(r),{body:r,poses:s,many:s.length>7}}),this.move(0)}triangles(t){if(this.legend(t.map(n=>n.material)),!this.renderer)return;this.clear("bodies"),this.bodies=t.map(({corners:n,material:s})=>{let r=new gn;r.setAttribute("position",new vn(n,3));let o=new Sn(r,new Ns({color:Vs(Pr(s,"")),side:ri,flatShading:!0}));return o.userData={material:s},this.layers.bodies.add(o),{body:o,poses:new Float32Array([0,0,0,0,0,0,1]),many:!1}});let{size:e}=this.extent();Object.assign(this.camera,{near:e/1e3,far:30*e}),this.camera.updateProjectionMatrix(),this.controls.maxPolarAngle=Math.PI,this.draw()}legend(t){this.key.hidden=!t.length,this.key.replaceChildren(...[...new Set(t)].map(e=>F("span",{},F("i",{style:`background:rgb(${Pr(e,"").join(",")})`}),e||"without a material")))}static used(t){let e=t.objects.flatMap(n=>"mesh"in n.shape&&!Vf.has(n.class)?t.meshes[n.shape.mesh].materials.map(([s])=>s):[]);return[...new Set(e)].sort((n,s)=>n-s).map(n=>t.materials[n]??"")}extent(){let[t,e]=this.bounds();return{middle:t.map((n,s)=>.5*(n+e[s])),size:Math.max(.005,Math.hypot(...t.map((n,s)=>e[s]-n)))}}move(t){for(let{body:e,poses:n,many:s}of this.bodies??[]){let r=n.subarray(s?7*t:0);e.position.set(r[0],r[1],r[2]),e.quaternion.set(r[3],r[4],r[5],r[6])}this.draw()}clear(t){for(let e of[...this.layers[t].children])e.geometry?.dispose(),this.layers[t].remove(e)}boxes(t){if(this.renderer){this.clear("boxes");for(let e of t??[]){let[n,s,r]=e.size.map(l=>Math.max(.02,l)),a=Vf.has(e.class)?new Sn(new hs(n,s,r),new Ns({color:Vs(Pr("asphalt",e.class))})):new Io(new Do(new hs(n,s,r)),new er({color:Vs(qi(e.class))}));a.position.set(...e.pose.slice(0,3)),a.quaternion.set(...e.pose.slice(3)),a.userData=e,this.layers.boxes.add(a)}this.draw()}}line(t,e,n,s={}){let r=new gn;r.setAttribute("position",new vn(Float32Array.from(e),3)),this.layers[t].add(new Ro(r,new er({color:Vs(n),transparent:!0,opacity:s.opacity??.9})))}lanes(t){if(this.renderer){this.clear("lanes");for(let e of t??[])for(let n of["left","right"]){let s=Float32Array.from(Vn(e[n]));for(let r=2;r<s.length;r+=3)s[r]+=.03;this.line("lanes",s,Gf)}}}estimates(t){if(this.renderer){this.clear("estimates");for(let{points:e,confidence:n}of t??[]){let s=new kr;s.setPositions(Vn(e));let r=new zs({color:Vs(Hf),linewidth:3,transparent:!0,opacity:.35+.6*Math.min(1,Math.max(0,n))});r.resolution.set(this.box.clientWidth,this.box.clientHeight);let o=new yl(s,r);o.renderOrder=3,this.layers.estimates.add(o)}this.draw()}}sensors(t,e){if(this.renderer){if(this.clear("ego"),this.clear("field"),t){let n=new Io(new Do(new hs(4.5,1.8,1.4)),new er({color:Vs([86,180,233])})),s=new Je(...t.slice(3));n.position.copy(new k(1.35,0,.8).applyQuaternion(s)).add(new k(...t.slice(0,3))),n.quaternion.copy(s),this.layers.ego.add(n)}for(let{pose:n,halfAngle:s,range:r}of e){if(!n)continue;let o=new Je(...n.slice(3)),a=new k(...n.slice(0,3)),l=[a.clone()];for(let c=-24;c<=24;c++){let u=c/24*s;l.push(new k(r*Math.cos(u),r*Math.sin(u),0).applyQuaternion(o).add(a))}l.push(a.clone()),this.line("field",l.flatMap(c=>c.toArray()),[86,180,233],{opacity:.5})}}}mask(t,e,n){if(!this.renderer||(this.clear("mask"),!t))return;let{rows:s,columns:r,ahead_m:o,across_m:a,classes:l}=t,c=document.createElement("canvas");c.width=r,c.height=s;let u=new ImageData(r,s);l.forEach((p,g)=>n[p]&&u.data.set([...n[p],150],4*((s-1-Math.floor(g/r))*r+g%r))),c.getContext("2d").putImageData(u,0,0);let h=new Lo(c);h.magFilter=mn,h.colorSpace=jn;let d=new Sn(new Tr(a,o),new Mr({map:h,transparent:!0,depthWrite:!1,side:ri})),f=new Je(...e.slice(3)),m=new k(1,0,0).applyQuaternion(f),y=Math.atan2(m.y,m.x);d.rotation.z=y-Math.PI/2,d.position.set(e[0]+.5*o*Math.cos(y),e[1]+.5*o*Math.sin(y),.02),this.layers.mask.add(d),this.draw()}tracks(t){if(this.renderer){this.clear("tracks");for(let e of t){this.line("tracks",[e.x,e.y,.8,e.x+e.vx,e.y+e.vy,.8],[204,121,167]);let n=[];for(let s=0;s<=24;s++)n.push(e.x+.9*Math.cos(s*Math.PI/12),e.y+.9*Math.sin(s*Math.PI/12),.8);this.line("tracks",n,[204,121,167])}this.draw()}}points(t,e){if(this.renderer){if(this.clear("points"),this.places=t,t.length){let n=new gn;n.setAttribute("position",new vn(t,3)),n.setAttribute("color",new vn(e,3));let s=new wr({size:t.length>15e3?4:9,sizeAttenuation:!1,vertexColors:!0,map:this.texture,alphaTest:.5,depthTest:!1,transparent:!0}),r=new Po(n,s);r.renderOrder=5,this.layers.points.add(r)}this.draw()}}choose(t,e,n){if(this.renderer){if(this.clear("chosen"),this.clear("paths"),t){let s=new gn;s.setAttribute("position",new vn(Float32Array.from(t),3));let r=new Po(s,new wr({size:18,sizeAttenuation:!1,color:16723285,map:this.texture,alphaTest:.5,depthTest:!1,transparent:!0,opacity:.85}));if(r.renderOrder=4,this.layers.chosen.add(r),e){let o=new Sn(new No(1,16,10),new Mr({color:16723285,wireframe:!0,transparent:!0,opacity:.45}));o.matrixAutoUpdate=!1,o.matrix.set(e[0].x*n[0],e[1].x*n[1],e[2].x*n[2],t[0],e[0].y*n[0],e[1].y*n[1],e[2].y*n[2],t[1],e[0].z*n[0],e[1].z*n[1],e[2].z*n[2],t[2],0,0,0,1),this.layers.chosen.add(o)}}this.draw()}}paths(t,e){this.renderer&&(this.clear("paths"),t.forEach((n,s)=>{let r=new kr;r.setPositions(n.places.flat());let o=e==null||e===s,a=new zs({color:Vs(n.rgb),linewidth:o?3:1,dashed:!n.known,dashSize:.6,gapSize:.4,depthTest:!1,transparent:!0,opacity:o?.95:.3});a.resolution.set(this.box.clientWidth,this.box.clientHeight);let l=new yl(r,a);l.computeLineDistances(),l.renderOrder=6,this.layers.paths.add(l)}),this.draw())}look(t,e){this.renderer&&(this.controls.target.set(...t),this.camera.position.set(...e),this.controls.update(),this.draw())}along(t,e){if(!this.renderer)return;let n=a=>{let l=new k(1,0,0).applyQuaternion(new Je(...a.slice(3)));return Math.atan2(l.y,l.x)},s=new Je().setFromAxisAngle(new k(0,0,1),n(e)-n(t)),[r,o]=[new k(...t.slice(0,3)),new k(...e.slice(0,3))];for(let a of[this.controls.target,this.camera.position])a.sub(r).applyQuaternion(s).add(o);this.controls.update()}bounds(){let t=[1/0,1/0,1/0],e=[-1/0,-1/0,-1/0];for(let{body:n}of this.bodies??[]){n.updateMatrixWorld();let s=n.geometry;s.computeBoundingBox();for(let r of["min","max"])for(let o of["min","max"])for(let a of["min","max"]){let l=new k(s.boundingBox[r].x,s.boundingBox[o].y,s.boundingBox[a].z).applyMatrix4(n.matrixWorld).toArray();t=t.map((c,u)=>Math.min(c,l[u])),e=e.map((c,u)=>Math.max(c,l[u]))}}return t[0]<=e[0]?[t,e]:[[-1,-1,0],[1,1,1]]}project(t){let e=new k(...t).project(this.camera);return[(e.x+1)/2*this.box.clientWidth,(1-e.y)/2*this.box.clientHeight,e.z]}click(t){let e=this.box.getBoundingClientRect(),[n,s]=[t.clientX-e.left,t.clientY-e.top],r=-1,o=12,a=new k;for(let u=0;u<(this.places?.length??0)/3;u++){if(a.fromArray(this.places,3*u).project(this.camera),a.z>1)continue;let h=Math.hypot((a.x+1)/2*e.width-n,(1-a.y)/2*e.height-s);h<o&&([r,o]=[u,h])}if(r>=0)return this.pick({point:r});let l=new Va;l.setFromCamera(new Zt(2*n/e.width-1,1-2*s/e.height),this.camera);let c=l.intersectObjects([...this.layers.bodies.children,...this.layers.boxes.children],!1)[0];this.pick(c?{object:c.object.userData,material:c.face?.materialIndex,at:c.point.toArray()}:{})}show(t,e){this.renderer&&(this.layers[t].visible=e,this.draw())}};function f_(i,t,e){let n=new Je(...e.slice(3)),s=new k(Math.cos(t)*Math.cos(i),Math.cos(t)*Math.sin(i),Math.sin(t)),r=new k(-Math.sin(i),Math.cos(i),0);return[s,r,s.clone().cross(r)].map(o=>o.applyQuaternion(n))}function ia(i){let t=new Je(...i.slice(3)),e=new k(...i.slice(0,3));return(n,s,r)=>new k(n,s,r).applyQuaternion(t).add(e).toArray()}var ru=["vv","vh","hv","hh"],xA=["frequency_hz","azimuth_deg","elevation_deg",...ru.map(i=>`${i}_dbsm`),...ru.flatMap(i=>[`${i}_re_m`,`${i}_im_m`])],yA=30,p_=60,vA=250;function SA(i){let t=new Uint32Array(i),e=new Uint8Array(i),n=0,s=r=>{e[r]||(e[r]=1,t[n++]=r)};s(0),s(i-1);for(let r=2**Math.ceil(Math.log2(Math.max(2,i)));r>=1;r/=2)for(let o=0;o<i;o+=r)s(o);return t}var ou=class{constructor(){this.scene=new Li({pick:()=>{}}),this.lines=new Zi({x:"azimuth / \xB0",y:"cross section / dBsm",pick:e=>this.look(e)}),this.controls=F("form",{class:"controls",onsubmit:e=>e.preventDefault()}),this.told=F("p",{class:"told",role:"status"}),this.note=F("p",{class:"hint"}),this.past=[],this.future=[],this.done=Promise.resolve(),this.resolve=()=>{};let t=(e,n,s)=>F("button",{type:"button",title:n,onclick:s},e);this.tools=F("div",{class:"tools"},t("\u21B6","Undo (Ctrl+Z)",()=>this.undo()),t("\u21B7","Redo (Ctrl+Y)",()=>this.redo()),t("hold","Keep the curve to compare with",()=>this.hold()),F("span",{class:"hint"},"save as"),t("CSV","The cut as a table of cross sections",()=>this.save_csv()),t("GLB","The reflector with its radar material",()=>this.save_glb()),t("TOML","A study of this cut for catseye study",()=>this.save_toml()),t("PNG","The plot as a picture",()=>this.save_png())),this.element=F("main",{class:"design"},this.tools,F("section",{class:"left"},this.controls,this.told),F("section",{class:"right"},this.scene.box,this.lines.box,this.note))}async start(){await Ig(),Object.assign(this,JSON.parse(Wo.describe())),this.state=this.parse(Ot.spec),this.make_controls(),this.update(),this.reset()}parse(t){let[e,n=""]=t.split(/:(.*)/s),s=this.kinds.find(c=>c.name===e.trim())??this.kinds[0],r=Object.fromEntries(s.parameters.map(c=>[c.name,c.default])),o=s.material;for(let c of n.split(",").filter(Boolean)){let[u,h]=c.split("=").map(d=>d.trim());u==="material"?o=h:u in r&&(r[u]=Number.isNaN(Number(h))?h:Number(h))}let[a,l]=s.boresight_deg;return{kind:s.name,values:r,material:o,frequency_ghz:77,along:"azimuth",from:-45,to:45,steps:451,azimuth:a,elevation:l,bounces:3,ptd:!1}}spec(){let{kind:t,values:e,material:n}=this.state;return`${t}:${[...Object.entries(e),["material",n]].map(([s,r])=>`${s}=${r}`).join(",")}`}told_spec(){let{kind:t,values:e,material:n}=this.state,s=this.kind.parameters.filter(r=>e[r.name]!==r.default).map(r=>[r.name,e[r.name]]);return n!==this.kind.material&&s.push(["material",n]),s.length?`${t}:${s.map(([r,o])=>`${r}=${o}`).join(",")}`:t}get kind(){return this.kinds.find(t=>t.name===this.state.kind)}set(t,e){(!e||!this.moving)&&this.past.push(structuredClone(this.state)),this.moving=e,this.future=[],t(this.state),this.update()}undo(){this.past.length&&(this.future.push(this.state),this.state=this.past.pop(),this.make_controls(),this.update())}redo(){this.future.length&&(this.past.push(this.state),this.state=this.future.pop(),this.make_controls(),this.update())}make_controls(){let t=this.state,e=this.kind,n=e.parameters.map(o=>this.row(o.name,o.doc,o.allowed,o,()=>this.state.values[o.name],a=>l=>{l.values[o.name]=a})),s=fn("kind",this.kinds.map(o=>[o.name,o.name]),t.kind,o=>this.set(a=>{Object.assign(a,this.parse(o),{frequency_ghz:a.frequency_ghz,bounces:a.bounces,ptd:a.ptd}),queueMicrotask(()=>{this.make_controls(),this.reset()})})),r=(o,a,l,c,u)=>this.row(o,a,`${l} to ${c}`,{[u?"whole":"number"]:!0,min:l,max:c,default:t[o]},()=>this.state[o],h=>d=>{d[o]=h});this.controls.replaceChildren(s,F("p",{class:"hint"},`${e.summary}. ${e.pose}`),...n,fn("material",this.materials.map(o=>[o,o]),t.material,o=>this.set(a=>{a.material=o})),F("h3",{},"The cut"),r("frequency_ghz","Frequency, GHz",1,300),fn("along",[["azimuth","azimuth"],["elevation","elevation"]],t.along,o=>this.set(a=>{a.along=o,queueMicrotask(()=>this.make_controls())})),r("from","First angle, degrees",-180,180),r("to","Last angle, degrees",-180,180),r("steps","Number of directions",2,2001,!0),r(t.along==="azimuth"?"elevation":"azimuth","The other angle, degrees",t.along==="azimuth"?-90:-180,t.along==="azimuth"?90:180),r("bounces","Reflections that are followed",1,8,!0),F("label",{class:"toggle"},F("input",{type:"checkbox",checked:t.ptd,onchange:o=>this.set(a=>{a.ptd=o.target.checked})}),"edges diffract (PTD)"))}row(t,e,n,s,r,o){let a=`${e}; ${n}`;if(s.choice)return fn(t,s.choice.map(p=>[p,p]),r(),p=>this.set(o(p)));if(s.material)return fn($s(t),[["none","none"],...this.materials.map(p=>[p,p])],r(),p=>this.set(o(p)));let l=s.number&&s.min>0&&s.max/s.min>yA,[c,u]=l?[Math.max(s.min,(s.default||1)/20),Math.min(s.max,(s.default||1)*20)]:[s.min,s.max],h=p=>l?1e3*Math.log(p/c)/Math.log(u/c):1e3*(p-c)/(u-c),d=p=>l?c*(u/c)**(p/1e3):c+(u-c)*p/1e3,f=p=>s.whole?Math.round(p):Number(p.toPrecision(4)),m=F("input",{type:"text",inputMode:"decimal",value:r(),"aria-label":t,title:a,onchange:()=>{let p=Number(m.value.replace(",","."));if(m.value.trim()===""||!(p>=s.min&&p<=s.max)||s.whole&&!Number.isInteger(p)){this.complain(`${t} = ${m.value}: allowed: ${n}`),m.setAttribute("aria-invalid","true");return}m.removeAttribute("aria-invalid"),y.value=h(p),this.set(o(p))}}),y=F("input",{type:"range",min:0,max:1e3,step:s.whole?1e3/Math.max(1,u-c):1,"aria-label":`${t} by a slider`,title:a,oninput:()=>{let p=f(d(Number(y.value)));m.value=p,m.removeAttribute("aria-invalid"),this.set(o(p),!0)},onchange:()=>{this.moving=!1}});return y.value=h(r()),F("label",{class:"row",title:a},F("span",{},`${$s(t)}${Oi(t)?` / ${Oi(t)}`:""}`),y,m)}complain(t){this.told.textContent=t}directions(){let{along:t,from:e,to:n,steps:s,azimuth:r,elevation:o}=this.state,a=Float64Array.from({length:s},(c,u)=>e+(n-e)*u/Math.max(1,s-1)),l=new Float64Array(s).fill(t==="azimuth"?o:r);return t==="azimuth"?[a,l,a]:[l,a,a]}update(){clearTimeout(this.next),this.finish();let t,e;try{t=new Wo.Target(this.spec()),e=wg(t.glb())}catch(o){t?.free(),this.refuse(o);return}let[n,s,r]=this.directions();this.target=t,this.cut={azimuth:n,elevation:s,x:r,found:new Float64Array(8*r.length),order:SA(r.length),at:0,count:1},this.ms=0,this.drawn=-1/0,this.done=new Promise(o=>{this.resolve=o}),this.advance(e)}refuse(t){if(t instanceof WebAssembly.RuntimeError)throw t;this.complain(t.message)}advance(t){let{cut:e,target:n}=this,{frequency_ghz:s,bounces:r,ptd:o}=this.state,a=performance.now();try{for(;e.at<e.order.length;){let c=e.order.slice(e.at,e.at+e.count),u=performance.now(),h=n.cut(1e9*s,Float64Array.from(c,f=>e.azimuth[f]),Float64Array.from(c,f=>e.elevation[f]),r,o);c.forEach((f,m)=>e.found.set(h.subarray(8*m,8*m+8),8*f)),e.at+=c.length;let d=performance.now()-u;if(e.count=Math.max(1,Math.floor(e.count*Math.min(8,p_/Math.max(d,.01)))),performance.now()-a>p_)break}}catch(c){this.finish(),this.refuse(c);return}this.ms+=performance.now()-a;let l=e.at===e.order.length;if(t&&(this.complain(""),this.scene.triangles(t)),(l||performance.now()-this.drawn>vA)&&(this.take(),this.draw(),this.drawn=performance.now()),!l){this.next=setTimeout(()=>this.advance());return}this.finish()}finish(){this.target?.free(),this.target=void 0,this.resolve()}take(){let{cut:t}=this,e=Uint32Array.from(t.order.subarray(0,t.at)).sort(),n=a=>Float64Array.from(e,l=>a[l]),s=new Float64Array(8*e.length);e.forEach((a,l)=>s.set(t.found.subarray(8*a,8*a+8),8*l)),this.result={azimuth:n(t.azimuth),elevation:n(t.elevation),x:n(t.x),found:s},this.levels=ru.map((a,l)=>Array.from(e,(c,u)=>{let[h,d]=[s[8*u+2*l],s[8*u+2*l+1]],f=10*Math.log10(4*Math.PI*(h*h+d*d));return Number.isFinite(f)?f:null}));let r=this.levels[0].reduce((a,l,c)=>l!=null&&(this.levels[0][a]==null||l>this.levels[0][a])?c:a,0),o=t.at===t.x.length?`${t.x.length}`:`${t.at} of ${t.x.length}`;this.note.textContent=`${this.told_spec()} \xB7 VV ${jt(this.levels[0][r])} dBsm at ${jt(this.result.x[r])}\xB0 at most \xB7 ${o} directions in ${jt(this.ms,1)} ms`}draw(){let t=[["VV",0],["HH",3]].map(([n,s],r)=>({label:n,colour:ai(r),values:this.levels[s]})),e=Math.max(...this.levels.flat().filter(n=>n!=null));Math.max(...this.levels[1].filter(n=>n!=null))>e-40&&t.push({label:"VH",colour:ai(3),values:this.levels[1]}),this.held&&t.push({label:"VV held",colour:"#999",dash:[5,4],values:this.held_values()}),this.lines.labels.x=`${this.state.along} / \xB0`,this.lines.show(Array.from(this.result.x),t,{y:(n,s,r)=>[Math.max(s,e-60)-2,r+2]})}held_values(){let{x:t,values:e}=this.held;return Array.from(this.result.x,n=>{let s=t.findIndex(a=>a>=n);if(s<0||s===0&&t[0]>n)return null;if(t[s]===n||s===0)return e[s];let[r,o]=[e[s-1],e[s]];return r==null||o==null?null:r+(o-r)*(n-t[s-1])/(t[s]-t[s-1])})}hold(){this.held={x:Array.from(this.result.x),values:[...this.levels[0]]},this.draw()}look(t){if(!this.result||!this.scene.camera)return;let e=Math.PI/180,[n,s]=[this.result.azimuth[t]*e,Math.min(89.9,Math.max(-89.9,this.result.elevation[t]))*e],{middle:r,size:o}=this.scene.extent(),a=1.6*o;this.scene.look(r,[r[0]+a*Math.cos(s)*Math.cos(n),r[1]+a*Math.cos(s)*Math.sin(n),r[2]+a*Math.sin(s)])}reset(){this.look(this.levels?.[0].reduce((t,e,n)=>e>(this.levels[0][t]??-1/0)?n:t,0)??0)}save(t,e,n){let s=F("a",{href:URL.createObjectURL(new Blob([n],{type:e})),download:t});s.click(),setTimeout(()=>URL.revokeObjectURL(s.href),1e4)}async csv(){for(;this.target;)await this.done;let{azimuth:t,elevation:e,found:n}=this.result,s=this.state,r=[`# target: ${this.spec()}`,"# convention: every (which bounces radiate)",`# bounces: ${s.bounces}`,"# range_m: inf",`# diffraction: ${s.ptd?"ptd":"none"}`,"# engine: cpu (f64) in a page of the browser",`# version: catseye ${Ot.version}`,xA.join(",")];for(let o=0;o<t.length;o++){let a=[...n.subarray(8*o,8*o+8)],l=ru.map((c,u)=>{let h=10*Math.log10(4*Math.PI*(a[2*u]**2+a[2*u+1]**2));return Number.isFinite(h)?h.toFixed(6):"-inf"});r.push([1e9*s.frequency_ghz,t[o],e[o],...l,...a].join(","))}return`${r.join(`
`)}
`}async save_csv(){this.save(`${this.state.kind}.csv`,"text/csv",await this.csv())}save_glb(){let t=new Wo.Target(this.spec());this.save(`${this.state.kind}.glb`,"model/gltf-binary",t.glb()),t.free()}toml(){let t=this.state,e=t.along==="azimuth"?"elevation":"azimuth",n=Number(((t.to-t.from)/Math.max(1,t.steps-1)).toPrecision(9));return`# Made in a page of catseye view. catseye study ${t.kind}.toml -o out
name = "${t.kind}"
title = "${t.kind} over ${t.along}"
quantities = ["rcs_dbsm"]

[set]
target = "${this.spec()}"
frequency_hz = ${1e9*t.frequency_ghz}
${e}_deg = ${t[e]}

[solver]
bounces = ${t.bounces}
diffraction = "${t.ptd?"ptd":"none"}"

[[sweep]]
parameter = "${t.along}_deg"
start = ${t.from}
stop = ${t.to}
step = ${n}
`}save_toml(){this.save(`${this.state.kind}.toml`,"application/toml",this.toml())}save_png(){this.lines.plot.ctx.canvas.toBlob(t=>this.save(`${this.state.kind}.png`,"image/png",t))}key_press(t){t.key==="r"&&this.reset()}shortcut(t){if(t.key==="z")this.undo();else if(t.key==="y")this.redo();else return!1;return!0}theme(){this.scene.theme(),this.lines.again()}};function m_(i,t,e){if(!i.names)return jt(t,e);let n=i.names[t]??"";return n.length>9?`${n.slice(0,8)}\u2026`:n}var sa={left:52,right:66,top:10,bottom:38},fr=class{constructor({hover:t,pick:e,name:n,unit:s}){this.hover=t,this.pick=e,this.unit=s,this.palette="viridis";let{canvas:r,redraw:o}=xr((a,l,c)=>this.draw(a,l,c));this.canvas=r,this.redraw=o,r.setAttribute("role","img"),r.setAttribute("aria-label",n),this.note=F("div",{class:"note"}),this.box=F("div",{class:"map"},r,this.note),r.addEventListener("mousemove",a=>this.move(a)),r.addEventListener("mouseleave",()=>this.hover?.(null)),r.addEventListener("click",a=>{let l=this.cell(a);l&&this.pick?.(l[0],l[1],this.mark(a))})}show(t){if(this.map=t,!t)return this.redraw();let{rows:e,columns:n,at:s,low:r,high:o}=t,a=new ImageData(n,e),l=Xo[this.palette],c=255/Math.max(1e-9,o-r);for(let u=0;u<e;u++)for(let h=0;h<n;h++){let d=s(u,h),f=4*((e-1-u)*n+h),m=3*Math.round(Math.min(255,Math.max(0,(d-r)*c)));a.data[f]=l[m],a.data[f+1]=l[m+1],a.data[f+2]=l[m+2],a.data[f+3]=Number.isNaN(d)?0:255}this.picture=document.createElement("canvas"),this.picture.width=n,this.picture.height=e,this.picture.getContext("2d").putImageData(a,0,0),this.redraw()}mark_all(t,e){this.marks=t,this.chosen=e,this.redraw()}place(t,e){let{x:n,y:s,columns:r,rows:o}=this.map,a={x:sa.left,y:sa.top,w:Math.max(10,t-sa.left-sa.right),h:Math.max(10,e-sa.top-sa.bottom)},l=(f,m)=>[f.first-.5*f.step,f.first+(m-.5)*f.step],[c,u]=l(n,r),[h,d]=l(s,o);return{...a,x0:c,x1:u,y0:h,y1:d,px:f=>a.x+(f-c)/(u-c)*a.w,py:f=>a.y+(d-f)/(d-h)*a.h}}draw(t,e,n){if(!this.map)return;let s=this.place(e,n);t.imageSmoothingEnabled=!1,t.drawImage(this.picture,s.x,s.y,s.w,s.h);let r=Zn("ink");t.strokeStyle=Zn("grid"),t.strokeRect(s.x,s.y,s.w,s.h),t.fillStyle=r,t.font="11px system-ui",t.textAlign="center",t.textBaseline="top";let o=io(s.x0,s.x1,s.w/70),a=io(s.y0,s.y1,s.h/40);for(let l of o.list)t.fillText(m_(this.map.x,l,o.digits),s.px(l),s.y+s.h+4);t.fillText(this.map.x.label,s.x+s.w/2,s.y+s.h+20),t.textAlign="right",t.textBaseline="middle";for(let l of a.list)t.fillText(m_(this.map.y,l,a.digits),s.x-5,s.py(l));t.save(),t.translate(10,s.y+s.h/2),t.rotate(-Math.PI/2),t.textAlign="center",t.fillText(this.map.y.label,0,0),t.restore(),this.bar(t,s),t.save(),t.beginPath(),t.rect(s.x,s.y,s.w,s.h),t.clip();for(let l of this.marks??[]){let[c,u]=[s.px(l.x),s.py(l.y)],h=l.id===this.chosen;t.lineWidth=h?3:1.5,t.strokeStyle=h?"#ff2d55":l.colour,t.beginPath();let d=h?8:5;l.shape==="cross"?(t.moveTo(c-d,u-d),t.lineTo(c+d,u+d),t.moveTo(c-d,u+d),t.lineTo(c+d,u-d)):t.arc(c,u,d,0,2*Math.PI),t.stroke()}t.restore()}bar(t,e){let n=e.x+e.w+10,{low:s,high:r}=this.map,o=Xo[this.palette];for(let l=0;l<e.h;l++){let c=3*Math.round(255*(1-l/e.h));t.fillStyle=`rgb(${o[c]},${o[c+1]},${o[c+2]})`,t.fillRect(n,e.y+l,10,1.5)}t.fillStyle=Zn("ink"),t.textAlign="left",t.textBaseline="middle";let a=io(s,r,e.h/40);for(let l of a.list)t.fillText(jt(l,a.digits),n+13,e.y+e.h*(1-(l-s)/(r-s)));t.textBaseline="top",t.fillText(this.unit,n,e.y+e.h+4)}cell(t){if(!this.map)return null;let e=this.canvas.getBoundingClientRect(),n=this.place(e.width,e.height),s=(t.clientX-e.left-n.x)/n.w,r=(t.clientY-e.top-n.y)/n.h;return s<0||s>=1||r<0||r>=1?null:[this.map.rows-1-Math.floor(r*this.map.rows),Math.floor(s*this.map.columns)]}mark(t){let e=this.canvas.getBoundingClientRect(),n=this.place(e.width,e.height),s=null,r=10;for(let o of this.marks??[]){let a=Math.hypot(n.px(o.x)-(t.clientX-e.left),n.py(o.y)-(t.clientY-e.top));a<r&&([s,r]=[o,a])}return s}move(t){let e=this.cell(t);this.hover?.(e&&e[0],e&&e[1])}};var au=[[230,159,0],[0,158,115],[204,121,167],[86,180,233],[213,94,0],[240,228,66]],bA=[null,[86,180,233],[230,159,0],[0,114,178],[0,158,115]],MA=[["range_rate_mps","range rate"],["rcs_dbsm","cross section"],["snr_db","SNR"],["power_dbm","power"],["class","class"],["ghost","ghost or not"]],ra=class{constructor(){this.index=0,this.radar=0,this.by="range_rate_mps",this.names=new Map((Ot.scene?.objects??[]).map(t=>[t.id,t])),this.scene=new Li({pick:t=>this.hit(t)}),this.map=new fr({name:"range-Doppler map",unit:"dBm",hover:(t,e)=>this.hover(t,e),pick:(t,e,n)=>n?this.choose(n.id):this.cell(t,e)}),this.profile=new Zi({x:"range / m",y:"power / dBm"}),this.spectrum=new Zi({x:"azimuth / \xB0",y:"level / dB"}),this.details=F("div",{class:"details"}),this.list=F("div",{class:"list"}),this.element=this.layout()}async start(){this.scene.set(Ot.scene),await this.go(0),this.reset()}async renew(){this.names=new Map((Ot.scene?.objects??[]).map(t=>[t.id,t])),this.scene.set(Ot.scene),this.slider.max=Math.max(0,os-1),await this.go(Math.min(this.index,os-1))}layout(){let t=F("div",{class:"tools"},Ot.radars.length>1&&fn("radar",Ot.radars.map((a,l)=>[String(l),a.name]),"0",a=>this.take(Number(a))),fn("colour",MA,this.by,a=>{this.by=a,this.paint()}),fn("map",[["viridis","viridis"],["cividis","cividis"]],"viridis",a=>{this.map.palette=a,this.draw()}),this.follower(),this.toggle("lanes","lanes"),Ot.lanes&&this.toggle("lane estimates","estimates"),this.toggle("field of view","field"),this.toggle("tracks","tracks"),this.toggle("mask","mask"),F("button",{onclick:()=>this.reset(),title:"Behind the vehicle (r)"},"behind"),F("button",{onclick:()=>this.top(),title:"From above (t)"},"above"));this.legend=xr((a,l,c)=>this.key(a,l,c)),this.legend.canvas.className="key",this.legendText=F("div",{class:"key-text"}),this.found=F("div",{class:"legend found"}),this.part=F("p",{class:"part",role:"status",hidden:!0});let e=F("section",{class:"left"},t,this.part,this.scene.box,F("div",{class:"legend"},this.legend.canvas,this.legendText),Ot.lanes&&this.found);this.tabs={};let n=[["map","range-Doppler",this.map.box],["profile","profile",this.profile.box],["spectrum","angles",this.spectrum.box],["list","points",this.list]],s=n.map(([a,l,c],u)=>{let h=F("button",{role:"tab",title:`${l} (${u+1})`,onclick:()=>this.tab(a)},l);return this.tabs[a]={button:h,body:c},h}),r=F("section",{class:"right"},F("div",{class:"tabs",role:"tablist"},s),F("div",{class:"panes"},n.map(a=>a[2])),this.details);this.slider=F("input",{type:"range",min:0,max:Math.max(0,os-1),value:0,step:1,"aria-label":"frame",oninput:()=>this.go(Number(this.slider.value))}),this.play=F("button",{onclick:()=>this.toggle_play(),title:"Play or stop (space)"},"\u25B6"),this.clock=F("span",{class:"clock"}),this.bars=xr((a,l,c)=>this.figures(a,l,c)),this.bars.canvas.className="bars";let o=F("footer",{class:os>1?"time":"time single"},F("button",{onclick:()=>this.step(-1),title:"Frame before (\u2190)"},"|\u25C0"),this.play,F("button",{onclick:()=>this.step(1),title:"Next frame (\u2192)"},"\u25B6|"),F("div",{class:"track"},this.bars.canvas,this.slider),this.clock);return this.tab("map"),F("main",{class:"run"},e,r,o)}follower(){return this.follow=F("input",{type:"checkbox",checked:!0}),F("label",{class:"toggle",title:"Whether the view goes along with the vehicle"},this.follow,"follow")}toggle(t,e){let n=F("input",{type:"checkbox",checked:!0,onchange:()=>this.scene.show(e,n.checked)});return F("label",{class:"toggle"},n,t)}tab(t){for(let[e,{button:n,body:s}]of Object.entries(this.tabs))n.setAttribute("aria-selected",String(e===t)),s.hidden=e!==t;this.map.redraw(),this.profile.size(),this.spectrum.size()}key_press(t){let e={" ":()=>this.toggle_play(),ArrowLeft:()=>this.step(-1),ArrowRight:()=>this.step(1),r:()=>this.reset(),t:()=>this.top(),n:()=>this.next(1),p:()=>this.next(-1),Escape:()=>this.choose(null)}[t.key],n=["map","profile","spectrum","list"][Number(t.key)-1];n?this.tab(n):e&&(t.preventDefault(),e())}next(t){this.count&&this.choose(((this.chosen??(t>0?-1:this.count))+t+this.count)%this.count)}step(t){this.go(Math.min(os-1,Math.max(0,this.index+t)))}toggle_play(){this.playing=!this.playing,this.play.textContent=this.playing?"\u275A\u275A":"\u25B6";let t=async()=>{if(!this.playing)return;let e=performance.now();await this.go((this.index+1)%os);let n=1e3*Math.max(.03,Math.min(.5,this.interval()));setTimeout(t,Math.max(0,n-(performance.now()-e)))};t()}interval(){return os>1?(Ot.frames.at(-1).time_s-Ot.frames[0].time_s)/(os-1):.1}async go(t){let e=this.ticket=(this.ticket??0)+1,n;try{n=await Mp(t)}catch(s){e===this.ticket&&this.complain(s.message);return}e===this.ticket&&(this.index=t,this.frame=n,this.slider.value=t,this.scene.move(t),this.scene.boxes(n.boxes),this.scene.lanes(n.lanes),Ot.lanes&&this.lane_figures(n.estimate),this.take(this.radar))}complain(t){this.playing=!1,this.play.textContent="\u25B6",this.details.replaceChildren(F("p",{class:"missing"},t))}take(t){this.radar=t,this.about=Ot.radars[t],this.own=this.frame.radars[t];let e=this.pose;this.chosen=null,this.count=wp(this.own.points);let n=this.pose=this.own.pose??[0,0,0,0,0,0,1];e&&this.follow.checked&&this.scene.along(e,n),this.scene.sensors(this.frame.ego,this.frame.radars.map((d,f)=>({pose:d.pose,halfAngle:Ot.radars[f].max_azimuth_deg*Math.PI/180,range:Math.min(Ot.radars[f].max_range_m,120)})));let s=ia(n),[r,o,a]=["x_m","y_m","z_m"].map(d=>Ln(this.own.points,d));this.positions=new Float32Array(3*this.count);for(let d=0;d<this.count;d++)this.positions.set(s(r[d],o[d],a[d]??0),3*d);let l=this.own.mask_road??this.own.mask_markers;this.scene.mask(l&&{...l,classes:Vn(l.classes)},n,bA);let c=Ot.tables?.tracks,u=Ln(c,"frame"),h=[];for(let d=0;d<u.length;d++)u[d]===this.frame.index&&h.push({id:Ln(c,"track_id")[d],x:Ln(c,"x_m")[d],y:Ln(c,"y_m")[d],vx:Ln(c,"vx_mps")[d],vy:Ln(c,"vy_mps")[d]});this.scene.tracks(h),this.levels=this.own.map&&Pl(this.own.map),this.limits=this.own.threshold&&Pl(this.own.threshold),this.clock.textContent=`frame ${this.frame.index}${this.frame.told?` \xB7 ${this.frame.told}`:""} \xB7 ${jt(this.frame.time_s,3)} s \xB7 ${this.count}${this.own.points_in_file?` of ${this.own.points_in_file}`:""} points${h.length?` \xB7 ${h.length} tracks`:""}`,this.part.hidden=!this.own.points_in_file,this.part.textContent=`Only the strongest ${this.count} of the ${this.own.points_in_file} points of this frame are shown.`,this.file_rows=Vn(this.own.point_rows),this.bars.redraw(),this.paint(),this.draw(),this.table(),this.choose(null)}lane_figures(t){this.scene.estimates(t?.lines);let e=(a,l)=>F("span",{},F("i",{style:`background:rgb(${a.join(",")})`}),l),n=(a,l,c)=>a==null?"\u2013":`${jt(a,c)} ${l}`,s=t?.heading_error_rad==null?null:t.heading_error_rad*180/Math.PI,r=a=>a==null?"\u2013":`${jt(100*a,1)} %`,o=[["offset error",n(t?.offset_error_m,"m",3)],["heading error",n(s,"\xB0",3)],["curvature error",n(t?.curvature_error_per_m,"1/m",5)],["precision",r(t?.precision)],["recall",r(t?.recall)]];this.found.replaceChildren(e(Gf,"true lanes"),e(Hf,Ot.lanes.method?`found by catseye ${Ot.lanes.method}`:"lane estimates"),...t?[t.no_lane&&F("span",{class:"hint"},`no lane: ${t.no_lane}`),t.mirror&&F("span",{class:"hint"},"the mirrored lane fits as well"),...o.map(([a,l])=>F("span",{},`${a} `,F("b",{},l)))].filter(Boolean):[F("span",{class:"hint"},"no look at this frame")],Ot.lanes.remark?F("span",{class:"hint"},Ot.lanes.remark):"")}paint(){let t=Ln(this.own.points,this.by);this.colours=new Float32Array(3*this.count);let e=1/0,n=-1/0,s=this.by==="class"||this.by==="ghost";for(let a=0;a<this.count&&!s;a++)Number.isFinite(t[a])&&([e,n]=[Math.min(e,t[a]),Math.max(n,t[a])]);this.by==="range_rate_mps"&&(n=-(e=-Math.max(Math.abs(e),Math.abs(n),.001))),n>e||([e,n]=[e-1||0,e+1||1]);let r=this.by==="range_rate_mps"?Xo.diverging:Xo.viridis;this.rgb=a=>this.by==="class"?qi(t[a]):this.by==="ghost"?t[a]?[213,94,0]:[86,180,233]:sf(r,(t[a]-e)/(n-e));for(let a=0;a<this.count;a++)this.colours.set(this.rgb(a).map(l=>l/255),3*a);this.scene.points(this.positions,this.colours),this.scale={low:e,high:n,table:r,named:s};let o=this.by==="class"?[...new Set(t)].sort():[];this.legendText.replaceChildren(...this.by==="class"?o.map(a=>F("span",{},F("i",{style:`background:rgb(${qi(a).join(",")})`}),a||"no object")):this.by==="ghost"?[["86,180,233","where something stands"],["213,94,0","ghost"]].map(([a,l])=>F("span",{},F("i",{style:`background:rgb(${a})`}),l)):[F("span",{},`${$s(this.by)} / ${Oi(this.by)}`)]),this.legend.redraw(),this.marks()}key(t,e,n){if(!this.scale||this.scale.named)return;let{low:s,high:r,table:o}=this.scale;for(let a=0;a<e;a++)t.fillStyle=`rgb(${sf(o,a/e).join(",")})`,t.fillRect(a,0,1.5,n-14);t.fillStyle=Zn("ink"),t.font="11px system-ui",t.textBaseline="bottom",t.textAlign="left",t.fillText(jt(s,1),0,n),t.textAlign="right",t.fillText(jt(r,1),e,n)}draw(){let{range_m:t,range_rate_mps:e}=this.about;if(!this.levels){this.map.show(null),this.hover(null);return}let n=Array.from({length:t.count*e.count},(o,a)=>this.levels.at(a)).filter(Number.isFinite).sort((o,a)=>o-a),s=n[Math.floor(.3*n.length)]??0,r=n.at(-1)??1;this.map.show({columns:t.count,rows:e.count,at:(o,a)=>this.levels.at(o*t.count+a),x:{...t,label:"range / m"},y:{...e,label:"range rate / (m/s)"},low:s,high:r}),this.marks()}fold(t){let{first:e,step:n,count:s}=this.about.range_rate_mps,r=n*s,o=e-.5*n,a=Math.floor((t-o)/r);return{rate:t-a*r,folds:a}}marks(){if(!this.levels)return;let[t,e]=["range_m","range_rate_mps"].map(s=>Ln(this.own.points,s)),n=[];for(let s=0;s<this.count;s++){let r=this.fold(e[s]);n.push({x:t[s],y:r.rate,id:s,colour:r.folds?"#ff2d55":"#ffffff",shape:r.folds?"cross":"ring"})}this.map.mark_all(n,this.chosen)}hover(t,e){if(!this.levels){this.map.note.textContent="There is no map with this frame: [output] range_doppler = true of a scenario, or [keep] of a recipe, keeps it.";return}if(t==null){this.map.note.textContent=this.chosen==null?"Point at a cell for its level; click a ring for its point.":"";return}let{range_m:n,range_rate_mps:s}=this.about,r=t*n.count+e,o=this.limits?`, threshold ${jt(this.limits.at(r),1)} dBm`:"";this.map.note.textContent=`${jt(n.first+e*n.step)} m, ${jt(s.first+t*s.step)} m/s: ${jt(this.levels.at(r),1)} dBm${o}`}cell(t,e){this.row(t,e),this.tab("profile")}row(t,e){if(!this.levels)return;let{range_m:n,range_rate_mps:s}=this.about,r=u=>Array.from({length:n.count},(h,d)=>{let f=u.at(t*n.count+d);return Number.isNaN(f)?null:f}),o=[{label:"power",colour:ai(0),values:r(this.levels)}];this.limits&&o.push({label:"threshold",colour:ai(5),values:r(this.limits),dash:[5,4]});let a=Ln(this.own.points,"range_m"),l=Ln(this.own.points,"range_rate_mps"),c=new Array(n.count).fill(null);for(let u=0;u<this.count;u++){let h=Math.round((this.fold(l[u]).rate-s.first)/s.step),d=Math.round((a[u]-n.first)/n.step);h===t&&d>=0&&d<n.count&&(c[d]=this.levels.at(t*n.count+d))}o.push({label:"points",colour:ai(2),values:c,points:!0}),this.profile.show(Array.from({length:n.count},(u,h)=>n.first+h*n.step),o,{title:`${jt(s.first+t*s.step)} m/s`,marks:e==null?[]:[{x:n.first+e*n.step,colour:"#ff2d55"}]})}angles(t){let e=this.own.spectrum_cells,n=this.about.azimuth_deg;if(!e||!n?.length){this.spectrum.box.replaceChildren(F("p",{class:"missing"},"The run has no angle spectra ([output] angle_spectra = true keeps them)."));return}let[s,r]=["range_m","range_rate_mps"].map(m=>Ln(e,m)),[o,a]=["range_m","range_rate_mps"].map(m=>Ln(this.own.points,m)[t]),l=0,c=1/0;for(let m=0;m<s.length;m++){let y=((s[m]-o)/this.about.range_m.step)**2+((this.fold(r[m]).rate-this.fold(a).rate)/this.about.range_rate_mps.step)**2;y<c&&([l,c]=[m,y])}let u=Pl(this.own.spectra.levels),[,h,d]=this.own.spectra.shape,f=Array.from({length:d},(m,y)=>Math.max(...Array.from({length:h},(p,g)=>u.at((l*h+g)*d+y))));this.spectrum.box.querySelector(".missing")?.remove(),this.spectrum.show(n,[{label:"level",colour:ai(0),values:f}],{title:`${jt(s[l])} m, ${jt(r[l])} m/s`,marks:[{x:Ln(this.own.points,"azimuth_deg")[t],colour:"#ff2d55"}]})}name(t){let e=this.names.get(t)??this.frame.boxes?.find(n=>n.id===t);return e?`${e.name||e.class||"object"} (${t})`:t?`object ${t}`:"nothing known"}hit(t){if(t.point!=null)this.choose(t.point);else if(t.object){this.choose(null);let e=t.object,n=this.frame.actors?.find(s=>s.parts?.includes(e.id)||s.id===e.id);this.details.replaceChildren(F("h2",{},this.name(e.id)),Wf([["class",e.class||"\u2013"],["material",Ot.scene?.materials[t.material]??"\u2013"],["place",t.at.map(s=>jt(s)).join(", ")+" m"],...e.radar===!1?[["radar","sees through it"]]:[],...n?[["returns",n.returns],["their power",n.power_dbm==null?"\u2013":`${jt(n.power_dbm,1)} dBm`],["points",n.points],["ghosts of it",n.ghosts]]:[]]))}else this.choose(null)}choose(t){if(this.chosen=t,this.marks(),this.list.querySelector("tr.on")?.classList.remove("on"),t==null){this.scene.choose(null),this.details.replaceChildren(F("p",{class:"hint"},"Click a point, a ring in the map or a row of the table: its numbers and the ways of its echoes appear here.")),this.hover(null);return}let e=this.own.points,n=b=>Ln(e,b)[t],s=b=>(b??0)*Math.PI/180,r=[...this.positions.subarray(3*t,3*t+3)],o=["range_std_m","azimuth_std_deg","elevation_std_deg"].map(n),a=[o[0],s(o[1])*n("range_m"),s(o[2])*n("range_m")].map(b=>Math.max(.02,3*(b||0)));this.scene.choose(r,f_(s(n("azimuth_deg")),s(n("elevation_deg")),this.pose),a);let l=this.fold(n("range_rate_mps")),c=Math.round((l.rate-this.about.range_rate_mps.first)/this.about.range_rate_mps.step);this.row(c,Math.round((n("range_m")-this.about.range_m.first)/this.about.range_m.step)),this.angles(t);let u=b=>{let I=n(b);return I===""||I==null||Number.isNaN(I)?"\u2013":`${I} ${Oi(b)}`.trim()},h=!!n("ghost"),d=[["ghost","ghost"],["side_lobe","side lobe"],["folded","folded"],["aliased","aliased"]].filter(([b])=>n(b)).map(([,b])=>b),f=[n("class")||"no object",...d].join(", "),m=[["range",`${jt(n("range_m"))} \xB1 ${jt(o[0],3)} m`],["range rate",`${jt(n("range_rate_mps"))} m/s${l.folds?` (folds to ${jt(l.rate)})`:""}`],["azimuth",`${jt(n("azimuth_deg"))} \xB1 ${jt(o[1],2)}\xB0`],["SNR",`${jt(n("snr_db"),1)} dB`],["cross section",`${jt(n("rcs_dbsm"),1)} dBsm`],["object",this.name(n("object_id"))],["its share",`${jt(100*n("share"),1)} %`]],y=this.own.causes?.[t],p=ia(this.pose),g=(y?.echoes??[]).map((b,I)=>{let A=b.places.filter(Boolean),x=A.length===b.bounces&&b.bounces>0;return{places:[this.pose.slice(0,3),...A.map(T=>p(...T)),this.pose.slice(0,3)],known:x,rgb:au[I%au.length],echo:b}}).filter(b=>b.places.length>2);this.scene.paths(g);let v=(y?.echoes??[]).map((b,I)=>F("li",{onmouseenter:()=>this.scene.paths(g,I),onmouseleave:()=>this.scene.paths(g),tabIndex:0,onfocus:()=>this.scene.paths(g,I)},F("i",{style:`background:rgb(${au[I%au.length].join(",")})`}),F("b",{},`${jt(b.power_dbm,1)} dBm`),` ${b.bounces} ${b.bounces===1?"bounce":"bounces"}: `,["radar",...b.chain.map(A=>this.name(A)),"radar"].join(" \u2192 ")));this.details.replaceChildren(F("h2",{},`Point ${this.file_rows?this.file_rows[t]:t}: `,F("span",{style:`color:rgb(${qi(n("class")).join(",")})`},f)),Wf(m),F("h3",{},"Why it is there"),y?F("ol",{class:"echoes"},v.length?v:"No echo falls into its cell: noise, or a side lobe of something far away."):F("p",{class:"missing"},"There are no returns with this frame: [output] returns = true of a scenario keeps them."),y&&y.in_cell>v.length?F("p",{class:"hint"},`${y.in_cell} echoes fall into this cell and beam; those that the beam hears most are listed.`):"",y&&g.length===0&&v.length?F("p",{class:"hint"},"[output] return_places = true keeps the places of bounces, so that ways can be drawn."):"",F("details",{},F("summary",{},"all columns of points.csv"),Wf(Object.keys(e).map(b=>[b,u(b)]),"columns")));let E=this.list.querySelector(`tr[data-row="${t}"]`);E?.classList.add("on"),E?.scrollIntoView({block:"nearest"})}table(){let e=["range_m","range_rate_mps","azimuth_deg","snr_db","rcs_dbsm","class","ghost"],n=e.map(r=>Ln(this.own.points,r)),s=F("tbody");for(let r=0;r<Math.min(500,this.count);r++){let o=F("tr",{onclick:()=>this.choose(r)},n.map((a,l)=>F("td",{},l===6?a[r]?"ghost":"":typeof a[r]=="number"?jt(a[r]):a[r]??"\u2013")));o.dataset.row=r,s.append(o)}this.list.replaceChildren(F("table",{},F("thead",{},F("tr",{},e.map(r=>F("th",{},`${$s(r)}${Oi(r)?` / ${Oi(r)}`:""}`)))),s),this.count>500?F("p",{class:"hint"},`The first 500 of ${this.count} points; all are in the scene and the map.`):"")}figures(t,e,n){let s=Ot.notes.filter(o=>Ot.radars.length===1||o.radar===Ot.radars[this.radar].name),r=Math.max(1,...s.map(o=>o.points));s.forEach((o,a)=>{t.fillStyle=a===this.index?"#ff2d55":Zn("bar");let l=a/s.length*e;t.fillRect(l,n-n*o.points/r,Math.max(1,e/s.length-1),n*o.points/r)})}reset(){let[t,e]=[ia(this.pose)(18,0,0),ia(this.pose)(-14,0,9)];this.scene.look(t,e)}top(){let t=ia(this.pose)(25,0,0);this.scene.look(t,[t[0]-.1,t[1],t[2]+60])}theme(){this.scene.theme(),this.map.redraw(),this.profile.again(),this.spectrum.again(),this.legend.redraw(),this.bars.redraw()}};function Wf(i,t="facts"){return F("dl",{class:t},i.flatMap(([e,n])=>[F("dt",{},e),F("dd",{},n)]))}var lu={ArrayExpression:["elements"],ArrayPattern:["elements"],ArrowFunctionExpression:["params","body"],AssignmentExpression:["left","right"],AssignmentPattern:["left","right"],AwaitExpression:["argument"],BinaryExpression:["left","right"],BlockStatement:["body"],BreakStatement:["label"],CallExpression:["callee","arguments"],CatchClause:["param","body"],ChainExpression:["expression"],ClassBody:["body"],ClassDeclaration:["id","superClass","body"],ClassExpression:["id","superClass","body"],ConditionalExpression:["test","consequent","alternate"],ContinueStatement:["label"],DebuggerStatement:[],DoWhileStatement:["body","test"],EmptyStatement:[],ExperimentalRestProperty:["argument"],ExperimentalSpreadProperty:["argument"],ExportAllDeclaration:["exported","source","attributes"],ExportDefaultDeclaration:["declaration"],ExportNamedDeclaration:["declaration","specifiers","source","attributes"],ExportSpecifier:["local","exported"],ExpressionStatement:["expression"],ForInStatement:["left","right","body"],ForOfStatement:["left","right","body"],ForStatement:["init","test","update","body"],FunctionDeclaration:["id","params","body"],FunctionExpression:["id","params","body"],Identifier:[],IfStatement:["test","consequent","alternate"],ImportAttribute:["key","value"],ImportDeclaration:["specifiers","source","attributes"],ImportDefaultSpecifier:["local"],ImportExpression:["source","options"],ImportNamespaceSpecifier:["local"],ImportSpecifier:["imported","local"],JSXAttribute:["name","value"],JSXClosingElement:["name"],JSXClosingFragment:[],JSXElement:["openingElement","children","closingElement"],JSXEmptyExpression:[],JSXExpressionContainer:["expression"],JSXFragment:["openingFragment","children","closingFragment"],JSXIdentifier:[],JSXMemberExpression:["object","property"],JSXNamespacedName:["namespace","name"],JSXOpeningElement:["name","attributes"],JSXOpeningFragment:[],JSXSpreadAttribute:["argument"],JSXSpreadChild:["expression"],JSXText:[],LabeledStatement:["label","body"],Literal:[],LogicalExpression:["left","right"],MemberExpression:["object","property"],MetaProperty:["meta","property"],MethodDefinition:["key","value"],NewExpression:["callee","arguments"],ObjectExpression:["properties"],ObjectPattern:["properties"],PrivateIdentifier:[],Program:["body"],Property:["key","value"],PropertyDefinition:["key","value"],RestElement:["argument"],ReturnStatement:["argument"],SequenceExpression:["expressions"],SpreadElement:["argument"],StaticBlock:["body"],Super:[],SwitchCase:["test","consequent"],SwitchStatement:["discriminant","cases"],TaggedTemplateExpression:["tag","quasi"],TemplateElement:[],TemplateLiteral:["quasis","expressions"],ThisExpression:[],ThrowStatement:["argument"],TryStatement:["block","handler","finalizer"],UnaryExpression:["argument"],UpdateExpression:["argument"],VariableDeclaration:["declarations"],VariableDeclarator:["id","init"],WhileStatement:["test","body"],WithStatement:["object","body"],YieldExpression:["argument"]},wA=Object.keys(lu);for(let i of wA)Object.freeze(lu[i]);Object.freeze(lu);var g_=lu;function __(i){let t=Object.assign({},g_);for(let e of Object.keys(i))if(Object.hasOwn(t,e)){let n=new Set(i[e]);for(let s of t[e])n.add(s);t[e]=Object.freeze(Array.from(n))}else t[e]=Object.freeze(Array.from(i[e]));return Object.freeze(t)}function zr(i){return i[i.length-1]??null}function Kf(i){return i.type==="TOMLBare"?i.name:i.value}var C_=class{constructor(i,t){this.major=i,this.minor=t}lt(i,t){return this.major<i||this.major===i&&this.minor<t}gte(i,t){return this.major>i||this.major===i&&this.minor>=t}},x_=new C_(1,0),Tl=new C_(1,1),TA=Tl,AA={"1.0":x_,"1.0.0":x_,"1.1":Tl,"1.1.0":Tl,latest:Tl,next:Tl};function R_(i){return i&&AA[i]||TA}var y_={"unterminated-string":"Unterminated string constant","unterminated-table-key":"Unterminated table-key","unterminated-array":"Unterminated array","unterminated-inline-table":"Unterminated inline table","missing-key":"Empty bare keys are not allowed","missing-newline":"Must be a newline","missing-equals-sign":"Expected equal (=) token","missing-value":"Unspecified values are invalid","missing-comma":"Expected comma (,) token","dupe-keys":"Defining a key multiple times is invalid","unexpected-char":"Unexpected character","unexpected-token":"Unexpected token","invalid-control-character":"Control characters (codes < 0x1f and 0x7f) are not allowed","invalid-comment-character":"Invalid code point {{cp}} within comments","invalid-key-value-newline":"The key, equals sign, and value must be on the same line","invalid-inline-table-newline":"No newlines are allowed between the curly braces unless they are valid within a value","invalid-underscore":"Underscores are allowed between digits","invalid-space":"Unexpected spaces","invalid-three-quotes":"Three or more quotes are not permitted","invalid-date":"Unexpected invalid date","invalid-time":"Unexpected invalid time","invalid-leading-zero":"Leading zeros are not allowed","invalid-trailing-comma-in-inline-table":"Trailing comma is not permitted in an inline table","invalid-char-in-escape-sequence":"Invalid character in escape sequence","invalid-consecutive-dots-in-key":"Consecutive dots are not permitted in keys","invalid-code-point":"Invalid code point {{cp}}","invalid-trailing-dot-in-key":"Keys cannot end with a dot","invalid-leading-dot-in-key":"Keys cannot start with a dot"};function EA(i,t){return t?y_[i].replace(/\{\{(.*?)\}\}/gu,(e,n)=>n in t?t[n]:`{{${n}}}`):y_[i]}var I_=class extends SyntaxError{constructor(i,t,e,n,s){super(EA(i,s)),this.index=t,this.lineNumber=e,this.column=n}},z={EOF:-1,NULL:0,SOH:1,BACKSPACE:8,TABULATION:9,LINE_FEED:10,FORM_FEED:12,CARRIAGE_RETURN:13,ESCAPE:27,SO:14,US:31,SPACE:32,QUOTATION_MARK:34,HASH:35,SINGLE_QUOTE:39,PLUS_SIGN:43,COMMA:44,DASH:45,DOT:46,DIGIT_0:48,DIGIT_1:49,DIGIT_2:50,DIGIT_3:51,DIGIT_7:55,DIGIT_9:57,COLON:58,EQUALS_SIGN:61,LATIN_CAPITAL_A:65,LATIN_CAPITAL_E:69,LATIN_CAPITAL_F:70,LATIN_CAPITAL_T:84,LATIN_CAPITAL_U:85,LATIN_CAPITAL_Z:90,LEFT_BRACKET:91,BACKSLASH:92,RIGHT_BRACKET:93,UNDERSCORE:95,LATIN_SMALL_A:97,LATIN_SMALL_B:98,LATIN_SMALL_E:101,LATIN_SMALL_F:102,LATIN_SMALL_I:105,LATIN_SMALL_L:108,LATIN_SMALL_N:110,LATIN_SMALL_O:111,LATIN_SMALL_R:114,LATIN_SMALL_S:115,LATIN_SMALL_T:116,LATIN_SMALL_U:117,LATIN_SMALL_X:120,LATIN_SMALL_Z:122,LEFT_BRACE:123,RIGHT_BRACE:125,TILDE:126,DELETE:127,PAD:128,SUPERSCRIPT_TWO:178,SUPERSCRIPT_THREE:179,SUPERSCRIPT_ONE:185,VULGAR_FRACTION_ONE_QUARTER:188,VULGAR_FRACTION_THREE_QUARTERS:190,LATIN_CAPITAL_LETTER_A_WITH_GRAVE:192,LATIN_CAPITAL_LETTER_O_WITH_DIAERESIS:214,LATIN_CAPITAL_LETTER_O_WITH_STROKE:216,LATIN_SMALL_LETTER_O_WITH_DIAERESIS:246,LATIN_SMALL_LETTER_O_WITH_STROKE:248,GREEK_SMALL_REVERSED_DOTTED_LUNATE_SIGMA_SYMBOL:891,GREEK_CAPITAL_LETTER_YOT:895,CP_1FFF:8191,ZERO_WIDTH_NON_JOINER:8204,ZERO_WIDTH_JOINER:8205,UNDERTIE:8255,CHARACTER_TIE:8256,SUPERSCRIPT_ZERO:8304,CP_218F:8591,CIRCLED_DIGIT_ONE:9312,NEGATIVE_CIRCLED_DIGIT_ZERO:9471,GLAGOLITIC_CAPITAL_LETTER_AZU:11264,CP_2FEF:12271,IDEOGRAPHIC_COMMA:12289,CP_D7FF:55295,CP_E000:57344,CJK_COMPATIBILITY_IDEOGRAPH_F900:63744,ARABIC_LIGATURE_SALAAMUHU_ALAYNAA:64975,ARABIC_LIGATURE_SALLA_USED_AS_KORANIC_STOP_SIGN_ISOLATED_FORM:65008,REPLACEMENT_CHARACTER:65533,LINEAR_B_SYLLABLE_B008_A:65536,CP_EFFFF:983039,CP_10FFFF:1114111};function CA(i){return i>=z.NULL&&i<=z.US}function vl(i){return i===z.TABULATION||i===z.SPACE}function v_(i){return i===z.LINE_FEED||i===z.CARRIAGE_RETURN}function RA(i){return i>=z.LATIN_CAPITAL_A&&i<=z.LATIN_CAPITAL_Z}function IA(i){return i>=z.LATIN_SMALL_A&&i<=z.LATIN_SMALL_Z}function PA(i){return IA(i)||RA(i)}function Fe(i){return i>=z.DIGIT_0&&i<=z.DIGIT_9}function S_(i){return Fe(i)||i>=z.LATIN_SMALL_A&&i<=z.LATIN_SMALL_F||i>=z.LATIN_CAPITAL_A&&i<=z.LATIN_CAPITAL_F}function LA(i){return i>=z.DIGIT_0&&i<=z.DIGIT_7}function DA(i){return i>=0&&i<=55295||i>=57344&&i<=1114111}function NA(i,t){let e=0,n=i.length;for(;e<n;){let s=e+n>>>1,r=i[s];if(r===t)return s+1;r<t?e=s+1:n=s}return e}var UA=class{constructor(){this.offsets=[]}addOffset(i){for(let t=this.offsets.length-1;t>=0;t--){let e=this.offsets[t];if(e===i)return;if(e<i)break}this.offsets.push(i)}getLocFromIndex(i){let t=NA(this.offsets,i)+1;return{line:t,column:i-(t===1?0:this.offsets[t-2])}}},OA=class{constructor(i){this.locs=new UA,this.lastCodePoint=z.NULL,this.start=-1,this.end=0,this.text=i}next(){return this.lastCodePoint===z.EOF?z.EOF:this.lastCodePoint=this.moveAt(this.end)}getLocFromIndex(i){return this.locs.getLocFromIndex(i)}eat(i){return this.text.codePointAt(this.end)===i?(this.next(),!0):!1}moveAt(i){this.start=this.end=i;let t=this.text.codePointAt(this.start)??z.EOF;if(t===z.EOF)return this.end=this.start,t;if(this.end+=t>=65536?2:1,t===z.LINE_FEED)this.locs.addOffset(this.end);else if(t===z.CARRIAGE_RETURN)return this.text.codePointAt(this.end)===z.LINE_FEED&&(this.end++,this.locs.addOffset(this.end)),z.LINE_FEED;return t}},FA=typeof BigInt<"u",BA={16:"0x",10:"",8:"0o",2:"0b"},P_={[z.QUOTATION_MARK]:z.QUOTATION_MARK,[z.BACKSLASH]:z.BACKSLASH,[z.LATIN_SMALL_B]:z.BACKSPACE,[z.LATIN_SMALL_F]:z.FORM_FEED,[z.LATIN_SMALL_N]:z.LINE_FEED,[z.LATIN_SMALL_R]:z.CARRIAGE_RETURN,[z.LATIN_SMALL_T]:z.TABULATION},kA={...P_,[z.LATIN_SMALL_E]:z.ESCAPE},zA=class{constructor(i,t){this.backCode=!1,this.lastCodePoint=z.NULL,this.state="DATA",this.token=null,this.tokenStart=-1,this.valuesEnabled=!1,this.text=i,this.parserOptions=t||{},this.codePointIterator=new OA(i),this.tomlVersion=R_(this.parserOptions.tomlVersion),this.ESCAPES=this.tomlVersion.gte(1,1)?kA:P_}get start(){return this.codePointIterator.start}get end(){return this.codePointIterator.end}getLocFromIndex(i){return this.codePointIterator.getLocFromIndex(i)}reportParseError(i,t){let e=this.codePointIterator.start,n=this.codePointIterator.getLocFromIndex(e);throw new I_(i,e,n.line,n.column,t)}nextToken(){let i=this.token;if(i!=null)return this.token=null,i;let t=this.lastCodePoint;for(;t!==z.EOF&&!this.token;){t=this.nextCode();let e=this[this.state](t);if(!e)throw new Error(`Unknown error: pre state=${this.state}`);this.state=e}return i=this.token,this.token=null,i}nextCode(){return this.lastCodePoint===z.EOF?z.EOF:this.backCode?(this.backCode=!1,this.lastCodePoint):this.lastCodePoint=this.codePointIterator.next()}eatCode(i){return this.lastCodePoint===z.EOF?!1:this.backCode?this.lastCodePoint===i?(this.backCode=!1,!0):!1:this.codePointIterator.eat(i)}moveAt(i){this.backCode&&(this.backCode=!1),this.lastCodePoint=this.codePointIterator.moveAt(i)}back(i){return this.backCode=!0,i}punctuatorToken(){this.startToken(),this.endToken("Punctuator","end")}startToken(){this.tokenStart=this.codePointIterator.start}endToken(i,t,e,n){let{tokenStart:s}=this,r=this.codePointIterator[t],o=[s,r],a={start:this.codePointIterator.getLocFromIndex(s),end:this.codePointIterator.getLocFromIndex(r)};if(i==="Block")this.token={type:i,value:this.text.slice(s+1,r),range:o,loc:a};else{let l,c=this.text.slice(s,r);if(i==="BasicString"||i==="LiteralString"||i==="MultiLineBasicString"||i==="MultiLineLiteralString")l={type:i,value:c,string:e,range:o,loc:a};else if(i==="Integer"){let u=e;l={type:i,value:c,number:parseInt(u,n),bigint:FA?BigInt(BA[n]+u):null,range:o,loc:a}}else i==="Float"?l={type:i,value:c,number:e,range:o,loc:a}:i==="Boolean"?l={type:i,value:c,boolean:e,range:o,loc:a}:i==="LocalDate"||i==="LocalTime"||i==="LocalDateTime"||i==="OffsetDateTime"?l={type:i,value:c,date:e,range:o,loc:a}:l={type:i,value:c,range:o,loc:a};this.token=l}}DATA(i){for(;vl(i)||v_(i);)i=this.nextCode();if(i===z.HASH)return this.startToken(),"COMMENT";if(i===z.QUOTATION_MARK)return this.startToken(),"BASIC_STRING";if(i===z.SINGLE_QUOTE)return this.startToken(),"LITERAL_STRING";if(i===z.DOT||i===z.EQUALS_SIGN||i===z.LEFT_BRACKET||i===z.RIGHT_BRACKET||i===z.LEFT_BRACE||i===z.RIGHT_BRACE||i===z.COMMA)return this.punctuatorToken(),"DATA";if(this.valuesEnabled){if(i===z.DASH||i===z.PLUS_SIGN)return this.startToken(),"SIGN";if(i===z.LATIN_SMALL_N||i===z.LATIN_SMALL_I)return this.startToken(),this.back("NAN_OR_INF");if(Fe(i))return this.startToken(),this.back("NUMBER");if(i===z.LATIN_SMALL_T||i===z.LATIN_SMALL_F)return this.startToken(),this.back("BOOLEAN")}else if(b_(i,this.tomlVersion))return this.startToken(),"BARE";return i===z.EOF?"DATA":this.reportParseError("unexpected-char")}COMMENT(i){let t=this.tomlVersion.gte(1,1)?e=>{VA(e)||this.reportParseError("invalid-comment-character",{cp:JSON.stringify(String.fromCodePoint(e)).slice(1,-1)})}:e=>{Sl(e)&&this.reportParseErrorControlChar()};for(;!v_(i)&&i!==z.EOF;)t(i),i=this.nextCode();return this.endToken("Block","start"),"DATA"}BARE(i){for(;b_(i,this.tomlVersion);)i=this.nextCode();return this.endToken("Bare","start"),this.back("DATA")}BASIC_STRING(i){if(i===z.QUOTATION_MARK)return i=this.nextCode(),i===z.QUOTATION_MARK?"MULTI_LINE_BASIC_STRING":(this.endToken("BasicString","start",""),this.back("DATA"));let t=[];for(;i!==z.QUOTATION_MARK&&i!==z.EOF&&i!==z.LINE_FEED;){if(Sl(i))return this.reportParseErrorControlChar();if(i===z.BACKSLASH){i=this.nextCode();let e=this.ESCAPES[i];if(e){t.push(e),i=this.nextCode();continue}else if(i===z.LATIN_SMALL_U){let n=this.parseUnicode(4);t.push(n),i=this.nextCode();continue}else if(i===z.LATIN_CAPITAL_U){let n=this.parseUnicode(8);t.push(n),i=this.nextCode();continue}else if(i===z.LATIN_SMALL_X&&this.tomlVersion.gte(1,1)){let n=this.parseUnicode(2);t.push(n),i=this.nextCode();continue}return this.reportParseError("invalid-char-in-escape-sequence")}t.push(i),i=this.nextCode()}return i!==z.QUOTATION_MARK?this.reportParseError("unterminated-string"):(this.endToken("BasicString","end",String.fromCodePoint(...t)),"DATA")}MULTI_LINE_BASIC_STRING(i){let t=[];for(i===z.LINE_FEED&&(i=this.nextCode());i!==z.EOF;){if(i!==z.LINE_FEED&&Sl(i))return this.reportParseErrorControlChar();if(i===z.QUOTATION_MARK){let e=this.codePointIterator.start;if(this.eatCode(z.QUOTATION_MARK)&&this.eatCode(z.QUOTATION_MARK))return this.eatCode(z.QUOTATION_MARK)&&(t.push(z.QUOTATION_MARK),this.eatCode(z.QUOTATION_MARK)&&(t.push(z.QUOTATION_MARK),this.eatCode(z.QUOTATION_MARK)))?(this.moveAt(e),this.reportParseError("invalid-three-quotes")):(this.endToken("MultiLineBasicString","end",String.fromCodePoint(...t)),"DATA");this.moveAt(e)}if(i===z.BACKSLASH){i=this.nextCode();let e=this.ESCAPES[i];if(e){t.push(e),i=this.nextCode();continue}else if(i===z.LATIN_SMALL_U){let n=this.parseUnicode(4);t.push(n),i=this.nextCode();continue}else if(i===z.LATIN_CAPITAL_U){let n=this.parseUnicode(8);t.push(n),i=this.nextCode();continue}else if(i===z.LATIN_SMALL_X&&this.tomlVersion.gte(1,1)){let n=this.parseUnicode(2);t.push(n),i=this.nextCode();continue}else if(i===z.LINE_FEED){for(i=this.nextCode();vl(i)||i===z.LINE_FEED;)i=this.nextCode();continue}else if(vl(i)){let n=!0,s=this.codePointIterator.start,r;for(;(r=this.nextCode())!==z.EOF&&r!==z.LINE_FEED;)if(!vl(r)){this.moveAt(s),n=!1;break}if(n){for(i=this.nextCode();vl(i)||i===z.LINE_FEED;)i=this.nextCode();continue}}return this.reportParseError("invalid-char-in-escape-sequence")}t.push(i),i=this.nextCode()}return this.reportParseError("unterminated-string")}LITERAL_STRING(i){if(i===z.SINGLE_QUOTE)return i=this.nextCode(),i===z.SINGLE_QUOTE?"MULTI_LINE_LITERAL_STRING":(this.endToken("LiteralString","start",""),this.back("DATA"));let t=[];for(;i!==z.SINGLE_QUOTE&&i!==z.EOF&&i!==z.LINE_FEED;){if(Sl(i))return this.reportParseErrorControlChar();t.push(i),i=this.nextCode()}return i!==z.SINGLE_QUOTE?this.reportParseError("unterminated-string"):(this.endToken("LiteralString","end",String.fromCodePoint(...t)),"DATA")}MULTI_LINE_LITERAL_STRING(i){let t=[];for(i===z.LINE_FEED&&(i=this.nextCode());i!==z.EOF;){if(i!==z.LINE_FEED&&Sl(i))return this.reportParseErrorControlChar();if(i===z.SINGLE_QUOTE){let e=this.codePointIterator.start;if(this.eatCode(z.SINGLE_QUOTE)&&this.eatCode(z.SINGLE_QUOTE))return this.eatCode(z.SINGLE_QUOTE)&&(t.push(z.SINGLE_QUOTE),this.eatCode(z.SINGLE_QUOTE)&&(t.push(z.SINGLE_QUOTE),this.eatCode(z.SINGLE_QUOTE)))?(this.moveAt(e),this.reportParseError("invalid-three-quotes")):(this.endToken("MultiLineLiteralString","end",String.fromCodePoint(...t)),"DATA");this.moveAt(e)}t.push(i),i=this.nextCode()}return this.reportParseError("unterminated-string")}SIGN(i){return i===z.LATIN_SMALL_N||i===z.LATIN_SMALL_I?this.back("NAN_OR_INF"):Fe(i)?this.back("NUMBER"):this.reportParseError("unexpected-char")}NAN_OR_INF(i){if(i===z.LATIN_SMALL_N){let t=this.codePointIterator.start;if(this.eatCode(z.LATIN_SMALL_A)&&this.eatCode(z.LATIN_SMALL_N))return this.endToken("Float","end",NaN),"DATA";this.moveAt(t)}else if(i===z.LATIN_SMALL_I){let t=this.codePointIterator.start;if(this.eatCode(z.LATIN_SMALL_N)&&this.eatCode(z.LATIN_SMALL_F))return this.endToken("Float","end",this.text[this.tokenStart]==="-"?-1/0:1/0),"DATA";this.moveAt(t)}return this.reportParseError("unexpected-char")}NUMBER(i){let t=this.text[this.tokenStart],e=t==="+"?z.PLUS_SIGN:t==="-"?z.DASH:z.NULL;if(i===z.DIGIT_0){if(e===z.NULL){let o=this.codePointIterator.start,a=this.nextCode();if(Fe(a)){let l=this.nextCode();if(l===z.COLON)return this.data={hasDate:!1,year:0,month:0,day:0,hour:Number(String.fromCodePoint(z.DIGIT_0,a)),minute:0,second:0},"TIME_MINUTE";if(Fe(l)){let c=this.nextCode();if(Fe(c)&&this.eatCode(z.DASH))return this.data={hasDate:!0,year:Number(String.fromCodePoint(z.DIGIT_0,a,l,c)),month:0,day:0,hour:0,minute:0,second:0},"DATE_MONTH"}return this.moveAt(o),this.reportParseError("invalid-leading-zero")}this.moveAt(o)}return i=this.nextCode(),i===z.LATIN_SMALL_X||i===z.LATIN_SMALL_O||i===z.LATIN_SMALL_B?e!==z.NULL?this.reportParseError("unexpected-char"):i===z.LATIN_SMALL_X?"HEX":i===z.LATIN_SMALL_O?"OCTAL":"BINARY":i===z.LATIN_SMALL_E||i===z.LATIN_CAPITAL_E?(this.data={minus:e===z.DASH,left:[z.DIGIT_0]},"EXPONENT_RIGHT"):i===z.DOT?(this.data={minus:e===z.DASH,absInt:[z.DIGIT_0]},"FRACTIONAL_RIGHT"):(this.endToken("Integer","start","0",10),this.back("DATA"))}let{out:n,nextCp:s,hasUnderscore:r}=this.parseDigits(i,Fe);return s===z.DASH&&e===z.NULL&&!r&&n.length===4?(this.data={hasDate:!0,year:Number(String.fromCodePoint(...n)),month:0,day:0,hour:0,minute:0,second:0},"DATE_MONTH"):s===z.COLON&&e===z.NULL&&!r&&n.length===2?(this.data={hasDate:!1,year:0,month:0,day:0,hour:Number(String.fromCodePoint(...n)),minute:0,second:0},"TIME_MINUTE"):s===z.LATIN_SMALL_E||s===z.LATIN_CAPITAL_E?(this.data={minus:e===z.DASH,left:n},"EXPONENT_RIGHT"):s===z.DOT?(this.data={minus:e===z.DASH,absInt:n},"FRACTIONAL_RIGHT"):(this.endToken("Integer","start",e===z.DASH?String.fromCodePoint(z.DASH,...n):String.fromCodePoint(...n),10),this.back("DATA"))}HEX(i){let{out:t}=this.parseDigits(i,S_);return this.endToken("Integer","start",String.fromCodePoint(...t),16),this.back("DATA")}OCTAL(i){let{out:t}=this.parseDigits(i,LA);return this.endToken("Integer","start",String.fromCodePoint(...t),8),this.back("DATA")}BINARY(i){let{out:t}=this.parseDigits(i,e=>e===z.DIGIT_0||e===z.DIGIT_1);return this.endToken("Integer","start",String.fromCodePoint(...t),2),this.back("DATA")}FRACTIONAL_RIGHT(i){let{minus:t,absInt:e}=this.data,{out:n,nextCp:s}=this.parseDigits(i,Fe),r=[...e,z.DOT,...n];if(s===z.LATIN_SMALL_E||s===z.LATIN_CAPITAL_E)return this.data={minus:t,left:r},"EXPONENT_RIGHT";let o=Number(t?String.fromCodePoint(z.DASH,...r):String.fromCodePoint(...r));return this.endToken("Float","start",o),this.back("DATA")}EXPONENT_RIGHT(i){let{left:t,minus:e}=this.data,n=!1;(i===z.DASH||i===z.PLUS_SIGN)&&(n=i===z.DASH,i=this.nextCode());let{out:s}=this.parseDigits(i,Fe),r=s;n&&r.unshift(z.DASH);let o=Number(e?String.fromCodePoint(z.DASH,...t,z.LATIN_SMALL_E,...r):String.fromCodePoint(...t,z.LATIN_SMALL_E,...r));return this.endToken("Float","start",o),this.back("DATA")}BOOLEAN(i){if(i===z.LATIN_SMALL_T){let t=this.codePointIterator.start;if(this.eatCode(z.LATIN_SMALL_R)&&this.eatCode(z.LATIN_SMALL_U)&&this.eatCode(z.LATIN_SMALL_E))return this.endToken("Boolean","end",!0),"DATA";this.moveAt(t)}else if(i===z.LATIN_SMALL_F){let t=this.codePointIterator.start;if(this.eatCode(z.LATIN_SMALL_A)&&this.eatCode(z.LATIN_SMALL_L)&&this.eatCode(z.LATIN_SMALL_S)&&this.eatCode(z.LATIN_SMALL_E))return this.endToken("Boolean","end",!1),"DATA";this.moveAt(t)}return this.reportParseError("unexpected-char")}DATE_MONTH(i){let t=this.codePointIterator.start;if(!Fe(i))return this.reportParseError("unexpected-char");if(i=this.nextCode(),!Fe(i))return this.reportParseError("unexpected-char");if(i=this.nextCode(),i!==z.DASH)return this.reportParseError("unexpected-char");let e=this.codePointIterator.start,n=this.data;return n.month=Number(this.text.slice(t,e)),"DATE_DAY"}DATE_DAY(i){let t=this.codePointIterator.start;if(!Fe(i))return this.reportParseError("unexpected-char");if(i=this.nextCode(),!Fe(i))return this.reportParseError("unexpected-char");let e=this.codePointIterator.end,n=this.data;if(n.day=Number(this.text.slice(t,e)),!HA(n.year,n.month,n.day))return this.reportParseError("invalid-date");if(i=this.nextCode(),i===z.LATIN_CAPITAL_T||i===z.LATIN_SMALL_T)return"TIME_HOUR";if(i===z.SPACE){let r=this.codePointIterator.start;if(Fe(this.nextCode())&&Fe(this.nextCode()))return this.moveAt(r),"TIME_HOUR";this.moveAt(r)}let s=bl(n,"");return this.endToken("LocalDate","start",s),this.back("DATA")}TIME_HOUR(i){let t=this.codePointIterator.start;if(!Fe(i))return this.reportParseError("unexpected-char");if(i=this.nextCode(),!Fe(i))return this.reportParseError("unexpected-char");if(i=this.nextCode(),i!==z.COLON)return this.reportParseError("unexpected-char");let e=this.codePointIterator.start,n=this.data;return n.hour=Number(this.text.slice(t,e)),"TIME_MINUTE"}TIME_MINUTE(i){let t=this.codePointIterator.start;if(!Fe(i))return this.reportParseError("unexpected-char");if(i=this.nextCode(),!Fe(i))return this.reportParseError("unexpected-char");let e=this.codePointIterator.end,n=this.data;return n.minute=Number(this.text.slice(t,e)),i=this.nextCode(),i===z.COLON?"TIME_SECOND":this.tomlVersion.lt(1,1)?this.reportParseError("unexpected-char"):Xf(n.hour,n.minute,n.second)?this.processTimeEnd(i,n):this.reportParseError("invalid-time")}TIME_SECOND(i){let t=this.codePointIterator.start;if(!Fe(i))return this.reportParseError("unexpected-char");if(i=this.nextCode(),!Fe(i))return this.reportParseError("unexpected-char");let e=this.codePointIterator.end,n=this.data;return n.second=Number(this.text.slice(t,e)),Xf(n.hour,n.minute,n.second)?(i=this.nextCode(),i===z.DOT?"TIME_SEC_FRAC":this.processTimeEnd(i,n)):this.reportParseError("invalid-time")}TIME_SEC_FRAC(i){if(!Fe(i))return this.reportParseError("unexpected-char");let t=this.codePointIterator.start;for(;Fe(i);)i=this.nextCode();let e=this.codePointIterator.start,n=this.data;return n.frac=this.text.slice(t,e),this.processTimeEnd(i,n)}processTimeEnd(i,t){if(t.hasDate){if(i===z.DASH||i===z.PLUS_SIGN)return t.offsetSign=i,"TIME_OFFSET";if(i===z.LATIN_CAPITAL_Z||i===z.LATIN_SMALL_Z){let s=bl(t,"Z");return this.endToken("OffsetDateTime","end",s),"DATA"}let n=bl(t,"");return this.endToken("LocalDateTime","start",n),this.back("DATA")}let e=bl(t,"");return this.endToken("LocalTime","start",e),this.back("DATA")}TIME_OFFSET(i){if(!Fe(i))return this.reportParseError("unexpected-char");let t=this.codePointIterator.start;if(i=this.nextCode(),!Fe(i))return this.reportParseError("unexpected-char");if(i=this.nextCode(),i!==z.COLON)return this.reportParseError("unexpected-char");let e=this.codePointIterator.start;i=this.nextCode();let n=this.codePointIterator.start;if(!Fe(i))return this.reportParseError("unexpected-char");if(i=this.nextCode(),!Fe(i))return this.reportParseError("unexpected-char");let s=this.codePointIterator.end,r=Number(this.text.slice(t,e)),o=Number(this.text.slice(n,s));if(!Xf(r,o,0))return this.reportParseError("invalid-time");let a=this.data,l=bl(a,`${String.fromCodePoint(a.offsetSign)}${pr(r,2)}:${pr(o,2)}`);return this.endToken("OffsetDateTime","end",l),"DATA"}parseDigits(i,t){if(i===z.UNDERSCORE)return this.reportParseError("invalid-underscore");if(!t(i))return this.reportParseError("unexpected-char");let e=[],n=z.NULL,s=!1;for(;t(i)||i===z.UNDERSCORE;){if(i===z.UNDERSCORE){if(s=!0,n===z.UNDERSCORE)return this.reportParseError("invalid-underscore")}else e.push(i);n=i,i=this.nextCode()}return n===z.UNDERSCORE?this.reportParseError("invalid-underscore"):{out:e,nextCp:i,hasUnderscore:s}}parseUnicode(i){let t=this.codePointIterator.start,e=this.codePointIterator.end,n=0,s;for(;(s=this.nextCode())!==z.EOF;){if(!S_(s))return this.moveAt(t),this.reportParseError("invalid-char-in-escape-sequence");if(n++,n>=i)break}let r=this.codePointIterator.end,o=this.text.slice(e,r),a=parseInt(o,16);return DA(a)?a:this.reportParseError("invalid-code-point",{cp:o})}reportParseErrorControlChar(){return this.reportParseError("invalid-control-character")}};function b_(i,t){return PA(i)||Fe(i)||i===z.UNDERSCORE||i===z.DASH?!0:(t.lt(1,1),!1)}function Sl(i){return CA(i)&&i!==z.TABULATION||i===z.DELETE}function VA(i){return i===z.TABULATION||z.SPACE<=i&&i<=z.TILDE||GA(i)}function GA(i){return z.PAD<=i&&i<=z.CP_D7FF||z.CP_E000<=i&&i<=z.CP_10FFFF}function HA(i,t,e){return i>=0&&t<=12&&t>=1&&e>=1?e<=(t===2?i&3||!(i%25)&&i&15?28:29:30+(t+(t>>3)&1)):!1}function Xf(i,t,e){return!(i>=24||i<0||t>59||t<0||e>60||e<0)}function bl(i,t){let e=pr(i.year,4),n=i.month?pr(i.month,2):"01",s=i.day?pr(i.day,2):"01",r=pr(i.hour,2),o=pr(i.minute,2),a=pr(i.second,2),l=`${e}-${n}-${s}`,c=i.frac?`.${i.frac}`:"",u=new Date(`${l}T${r}:${o}:${a}${c}${t}`);return!isNaN(u.getTime())||i.second!==60?u:new Date(`${l}T${r}:${o}:59${c}${t}`)}function pr(i,t){return String(i).padStart(t,"0")}var Zf=Symbol("VALUE_KIND_VALUE"),M_=Symbol("VALUE_KIND_INTERMEDIATE"),WA=class{constructor(i){this.rootKeys=new Map,this.tables=[],this.ctx=i}applyResolveKeyForTable(i){let t=this.rootKeys,e=i.key.keys.length-1;for(let o=0;o<e;o++){let a=i.key.keys[o],l=Kf(a);i.resolvedKey.push(l);let c=t.get(l);if(!c)c={node:a,keys:new Map},t.set(l,c);else if(c.table==="array"){let u=c.peekIndex;i.resolvedKey.push(u),c=c.keys.get(u)}t=c.keys}let n=i.key.keys[e],s=Kf(n);i.resolvedKey.push(s);let r=t.get(s);if(r)if(r.table)if(r.table==="array")if(i.kind==="array"){let o={node:n,keys:new Map},a=r.peekIndex+1;i.resolvedKey.push(a),r.keys.set(a,o),r.peekIndex=a,this.tables.push({node:i,keys:o.keys})}else this.ctx.reportParseError("dupe-keys",n);else this.ctx.reportParseError("dupe-keys",n);else if(i.kind==="array")this.ctx.reportParseError("dupe-keys",n);else{let o={table:i.kind,node:n,keys:r.keys};t.set(s,o),this.tables.push({node:i,keys:o.keys})}else if(i.kind==="array"){i.resolvedKey.push(0);let o={node:n,keys:new Map};t.set(s,{table:i.kind,node:n,keys:new Map([[0,o]]),peekIndex:0}),this.tables.push({node:i,keys:o.keys})}else{let o={table:i.kind,node:n,keys:new Map};t.set(s,o),this.tables.push({node:i,keys:o.keys})}}verifyDuplicateKeys(i){for(let t of i.body)t.type==="TOMLKeyValue"&&Jf(this.ctx,this.rootKeys,t);for(let{node:t,keys:e}of this.tables)for(let n of t.body)Jf(this.ctx,e,n)}};function Jf(i,t,e){let n=t,s=zr(e.key.keys);for(let r of e.key.keys){let o=Kf(r),a=n.get(o);a?((a.value===Zf||s===r||a.table)&&i.reportParseError("dupe-keys",hu(r,a.node)),a.value=M_):(s===r?a={value:Zf,node:r,keys:new Map}:a={value:M_,node:r,keys:new Map},n.set(o,a)),n=a.keys}e.value.type==="TOMLInlineTable"?L_(i,n,e.value):e.value.type==="TOMLArray"&&D_(i,n,e.value)}function L_(i,t,e){for(let n of e.body)Jf(i,t,n)}function D_(i,t,e){let n=t;for(let s=0;s<e.elements.length;s++){let r=e.elements[s],o=n.get(s);o?i.reportParseError("dupe-keys",hu(r,o.node)):(o={value:Zf,node:r,keys:new Map},t.set(s,o),r.type==="TOMLInlineTable"?L_(i,o.keys,r):r.type==="TOMLArray"&&D_(i,o.keys,r))}}function hu(i,t){return i.range[0]<=t.range[0]?t:i}var XA=class{constructor(i){this.tokens=[],this.comments=[],this.back=null,this.stateStack=[],this.needNewLine=!1,this.needSameLine=!1,this.currToken=null,this.prevToken=null,this.valueContainerStack=[],this.tokenizer=new zA(i.text,i.parserOptions),this.topLevelTable=i.topLevelTable,this.table=i.topLevelTable,this.keysResolver=new WA(this)}nextToken(i){if(this.prevToken=this.currToken,this.back?(this.currToken=this.back,this.back=null):this.currToken=this._nextTokenFromTokenizer(i),(this.needNewLine||this.needSameLine||i?.needSameLine)&&this.prevToken&&this.currToken)if(this.prevToken.loc.end.line===this.currToken.loc.start.line){if(this.needNewLine)return this.reportParseError("missing-newline",this.currToken)}else{let t=this.needSameLine||i?.needSameLine;if(t)return this.reportParseError(t,this.currToken)}return this.needNewLine=!1,this.needSameLine=!1,this.currToken}_nextTokenFromTokenizer(i){let t=this.tokenizer.valuesEnabled;i?.valuesEnabled&&(this.tokenizer.valuesEnabled=i.valuesEnabled);let e=this.tokenizer.nextToken();for(;e&&e.type==="Block";)this.comments.push(e),e=this.tokenizer.nextToken();return e&&this.tokens.push(e),this.tokenizer.valuesEnabled=t,e}backToken(){if(this.back)throw new Error("Illegal state");this.back=this.currToken,this.currToken=this.prevToken}addValueContainer(i){this.valueContainerStack.push(i),this.tokenizer.valuesEnabled=!0}consumeValueContainer(){let i=this.valueContainerStack.pop();return this.tokenizer.valuesEnabled=this.valueContainerStack.length>0,i}applyResolveKeyForTable(i){this.keysResolver.applyResolveKeyForTable(i)}verifyDuplicateKeys(){this.keysResolver.verifyDuplicateKeys(this.topLevelTable)}reportParseError(i,t){let e,n,s;if(t)e=t.range[0],n=t.loc.start.line,s=t.loc.start.column;else{e=this.tokenizer.start;let r=this.tokenizer.getLocFromIndex(e);n=r.line,s=r.column}throw new I_(i,e,n,s)}},w_={VALUE:"missing-value"},qA={BasicString:"basic",MultiLineBasicString:"basic",LiteralString:"literal",MultiLineLiteralString:"literal"},YA={BasicString:"basic",LiteralString:"literal"},$A={OffsetDateTime:"offset-date-time",LocalDateTime:"local-date-time",LocalDate:"local-date",LocalTime:"local-time"},KA=class{constructor(i,t){this.text=i,this.parserOptions=t||{},this.tomlVersion=R_(this.parserOptions.tomlVersion)}parse(){let i={type:"Program",body:[],sourceType:"module",tokens:[],comments:[],parent:null,range:[0,0],loc:{start:{line:1,column:0},end:{line:1,column:0}}},t={type:"TOMLTopLevelTable",body:[],parent:i,range:ci(i.range),loc:hi(i.loc)};i.body=[t];let e=new XA({text:this.text,parserOptions:this.parserOptions,topLevelTable:t}),n=e.nextToken();if(n){for(t.range[0]=n.range[0],t.loc.start=du(n.loc.start);n;){let a=e.stateStack.pop()||"TABLE";e.stateStack.push(...this[a](n,e)),n=e.nextToken()}let o=e.stateStack.pop()||"TABLE";if(o in w_)return e.reportParseError(w_[o],null);e.table.type==="TOMLTable"&&Ji(e.table,zr(e.table.body)),Ji(t,zr(t.body))}e.verifyDuplicateKeys(),i.tokens=e.tokens,i.comments=e.comments;let s=e.tokenizer.end,r=e.tokenizer.getLocFromIndex(s);return i.range[1]=s,i.loc.end={line:r.line,column:r.column},i}TABLE(i,t){return cu(i)||wl(i)?this.processKeyValue(i,t.table,t):Yf(i)?this.processTable(i,t.topLevelTable,t):t.reportParseError("unexpected-token",i)}VALUE(i,t){return wl(i)||E_(i)?this.processStringValue(i,t):JA(i)?this.processNumberValue(i,t):jA(i)?this.processBooleanValue(i,t):QA(i)?this.processDateTimeValue(i,t):Yf(i)?this.processArray(i,t):ZA(i)?this.processInlineTable(i,t):t.reportParseError("unexpected-token",i)}processTable(i,t,e){let n={type:"TOMLTable",kind:"standard",key:null,resolvedKey:[],body:[],parent:t,range:ci(i.range),loc:hi(i.loc)};e.table.type==="TOMLTable"&&Ji(e.table,zr(e.table.body)),t.body.push(n),e.table=n;let s=e.nextToken({needSameLine:"invalid-key-value-newline"});if(Yf(s)){if(i.range[1]<s.range[0])return e.reportParseError("invalid-space",s);n.kind="array",s=e.nextToken({needSameLine:"invalid-key-value-newline"})}if(Ml(s))return e.reportParseError("missing-key",s);if(!s)return e.reportParseError("unterminated-table-key",null);if(s=this.processKeyNode(s,n,e).nextToken,!Ml(s))return e.reportParseError("unterminated-table-key",s);if(n.kind==="array"){let r=s;if(s=e.nextToken({needSameLine:"invalid-key-value-newline"}),!Ml(s))return e.reportParseError("unterminated-table-key",s);if(r.range[1]<s.range[0])return e.reportParseError("invalid-space",s)}return Ji(n,s),e.applyResolveKeyForTable(n),e.needNewLine=!0,[]}processKeyValue(i,t,e){let n={type:"TOMLKeyValue",key:null,value:null,parent:t,range:ci(i.range),loc:hi(i.loc)};t.body.push(n);let{nextToken:s}=this.processKeyNode(i,n,e);return T_(s)?(e.addValueContainer({parent:n,set:r=>(n.value=r,Ji(n,r),e.needNewLine=!0,[])}),e.needSameLine="invalid-key-value-newline",["VALUE"]):e.reportParseError("missing-equals-sign",s)}processKeyNode(i,t,e){qf(i)&&e.reportParseError("invalid-leading-dot-in-key",i);let n={type:"TOMLKey",keys:[],parent:t,range:ci(i.range),loc:hi(i.loc)};t.key=n;let s=i,r=null;do{if(cu(s))this.processBareKey(s,n);else if(wl(s))this.processStringKey(s,n);else break;if(r=null,s=e.nextToken({needSameLine:"invalid-key-value-newline"}),!qf(s))break;r=s,s=e.nextToken({needSameLine:"invalid-key-value-newline"})}while(s);return r&&e.reportParseError(qf(s)?"invalid-consecutive-dots-in-key":"invalid-trailing-dot-in-key",r),Ji(n,zr(n.keys)),{keyNode:n,nextToken:s}}processBareKey(i,t){let e={type:"TOMLBare",name:i.value,parent:t,range:ci(i.range),loc:hi(i.loc)};t.keys.push(e)}processStringKey(i,t){let e={type:"TOMLQuoted",kind:"string",value:i.string,style:YA[i.type],multiline:!1,parent:t,range:ci(i.range),loc:hi(i.loc)};t.keys.push(e)}processStringValue(i,t){let e=t.consumeValueContainer(),n={type:"TOMLValue",kind:"string",value:i.string,style:qA[i.type],multiline:E_(i),parent:e.parent,range:ci(i.range),loc:hi(i.loc)};return e.set(n)}processNumberValue(i,t){let e=t.consumeValueContainer(),n=this.text,[s,r]=i.range,o=null,a=()=>o??(o=n.slice(s,r).replace(/_/g,"")),l;return i.type==="Integer"?l={type:"TOMLValue",kind:"integer",value:i.number,bigint:i.bigint,get number(){return a()},parent:e.parent,range:ci(i.range),loc:hi(i.loc)}:l={type:"TOMLValue",kind:"float",value:i.number,get number(){return a()},parent:e.parent,range:ci(i.range),loc:hi(i.loc)},e.set(l)}processBooleanValue(i,t){let e=t.consumeValueContainer(),n={type:"TOMLValue",kind:"boolean",value:i.boolean,parent:e.parent,range:ci(i.range),loc:hi(i.loc)};return e.set(n)}processDateTimeValue(i,t){let e=t.consumeValueContainer(),n={type:"TOMLValue",kind:$A[i.type],value:i.date,datetime:i.value,parent:e.parent,range:ci(i.range),loc:hi(i.loc)};return e.set(n)}processArray(i,t){let e=t.consumeValueContainer(),n={type:"TOMLArray",elements:[],parent:e.parent,range:ci(i.range),loc:hi(i.loc)},s=t.nextToken({valuesEnabled:!0});return Ml(s)?(Ji(n,s),e.set(n)):(t.backToken(),this.processArrayValue(n,e,t))}processArrayValue(i,t,e){return e.addValueContainer({parent:i,set:n=>{i.elements.push(n);let s=e.nextToken({valuesEnabled:!0}),r=A_(s);return r&&(s=e.nextToken({valuesEnabled:!0})),Ml(s)?(Ji(i,s),t.set(i)):r?(e.backToken(),this.processArrayValue(i,t,e)):e.reportParseError(s?"missing-comma":"unterminated-array",s)}}),["VALUE"]}processInlineTable(i,t){let e=t.consumeValueContainer(),n={type:"TOMLInlineTable",body:[],parent:e.parent,range:ci(i.range),loc:hi(i.loc)},s=this.tomlVersion.gte(1,1)?void 0:"invalid-inline-table-newline",r=t.nextToken({needSameLine:s});if(r){if(cu(r)||wl(r))return this.processInlineTableKeyValue(r,n,e,t);if($f(r))return Ji(n,r),e.set(n)}return t.reportParseError("unexpected-token",r)}processInlineTableKeyValue(i,t,e,n){let s={type:"TOMLKeyValue",key:null,value:null,parent:t,range:ci(i.range),loc:hi(i.loc)};t.body.push(s);let{nextToken:r}=this.processKeyNode(i,s,n);if(!T_(r))return n.reportParseError("missing-equals-sign",r);let o=this.tomlVersion.gte(1,1)?void 0:"invalid-inline-table-newline";return n.addValueContainer({parent:s,set:a=>{s.value=a,Ji(s,a);let l=n.nextToken({needSameLine:o});if(A_(l)){if(l=n.nextToken({needSameLine:o}),l&&(cu(l)||wl(l)))return this.processInlineTableKeyValue(l,t,e,n);if($f(l)){if(this.tomlVersion.lt(1,1))return n.reportParseError("invalid-trailing-comma-in-inline-table",l)}else return n.reportParseError(l?"unexpected-token":"unterminated-inline-table",l)}return $f(l)?(Ji(t,l),e.set(t)):n.reportParseError(l?"missing-comma":"unterminated-inline-table",l)}}),n.needSameLine="invalid-key-value-newline",["VALUE"]}};function qf(i){return Vr(i)&&i.value==="."}function T_(i){return Vr(i)&&i.value==="="}function Yf(i){return Vr(i)&&i.value==="["}function Ml(i){return Vr(i)&&i.value==="]"}function ZA(i){return Vr(i)&&i.value==="{"}function $f(i){return Vr(i)&&i.value==="}"}function A_(i){return Vr(i)&&i.value===","}function Vr(i){return!!(i&&i.type==="Punctuator")}function cu(i){return i.type==="Bare"}function wl(i){return i.type==="BasicString"||i.type==="LiteralString"}function E_(i){return i.type==="MultiLineBasicString"||i.type==="MultiLineLiteralString"}function JA(i){return i.type==="Integer"||i.type==="Float"}function jA(i){return i.type==="Boolean"}function QA(i){return i.type==="OffsetDateTime"||i.type==="LocalDateTime"||i.type==="LocalDate"||i.type==="LocalTime"}function Ji(i,t){t&&(i.range[1]=t.range[1],i.loc.end=du(t.loc.end))}function ci(i){return[i[0],i[1]]}function hi(i){return{start:du(i.start),end:du(i.end)}}function du(i){return{line:i.line,column:i.column}}var tE={Program:["body"],TOMLTopLevelTable:["body"],TOMLTable:["key","body"],TOMLKeyValue:["key","value"],TOMLKey:["keys"],TOMLArray:["elements"],TOMLInlineTable:["body"],TOMLBare:[],TOMLQuoted:[],TOMLValue:[]},eE=__(tE);function nE(i,t){return{ast:new KA(i,t).parse(),visitorKeys:eE,services:{isTOML:!0}}}var WI=iE(i=>i.value);function iE(i){function t(n,s){return e[n.type](n,s)}let e={Program(n,s={}){return t(n.body[0],s)},TOMLTopLevelTable(n,s={}){for(let r of n.body)t(r,s);return s},TOMLKeyValue(n,s={}){let r=t(n.value);return rE(s,t(n.key),r),s},TOMLTable(n,s={}){let r=sE(s,t(n.key),n.kind==="array");for(let o of n.body)t(o,r);return s},TOMLArray(n){return n.elements.map(s=>t(s))},TOMLInlineTable(n){let s={};for(let r of n.body)t(r,s);return s},TOMLKey(n){return n.keys.map(s=>t(s))},TOMLBare(n){return n.name},TOMLQuoted(n){return n.value},TOMLValue(n){return i(n)}};return n=>t(n)}function sE(i,t,e){let n=i;for(let l=0;l<t.length-1;l++){let c=t[l];n=a(n,c)}let s=zr(t),r=n[s];if(r==null){let l={};return n[s]=e?[l]:l,l}if(uu(r)){let l={};return n[s]=e?[l]:l,l}if(!e){if(Array.isArray(r)){let l={};return n[s]=l,l}return r}if(Array.isArray(r)){let l={};return r.push(l),l}let o={};return n[s]=[o],o;function a(l,c){let u=l[c];if(u==null){let d={};return l[c]=d,d}if(uu(u)){let d={};return l[c]=d,d}let h=u;for(;Array.isArray(h);){let d=h.length-1,f=h[d];if(uu(f)){let m={};return h[d]=m,m}h=f}return h}}function rE(i,t,e){let n=i;for(let s=0;s<t.length-1;s++){let r=t[s],o=n[r];if(o==null){let a={};n[r]=a,n=a}else if(uu(o)||Array.isArray(o)){let a={};n[r]=a,n=a}else n=o}n[zr(t)]=e}function uu(i){return typeof i!="object"||i instanceof Date}function N_(i,t){return nE(i,t).ast}var jf=/^[+-]?(?:0|[1-9]\d*)(?:\.\d+)?(?:[eE][+-]?\d+)?$/;function U_(i){let t=[],e=r=>r.reduce((o,a)=>typeof a=="number"?[...o.slice(0,-1),`${o.at(-1)} ${a+1}`]:[...o,String(a)],[]),n=r=>r.keys.map(o=>o.type==="TOMLBare"?o.name:o.value),s=(r,o,a,l)=>{if(r.type==="TOMLArray")r.elements.forEach((c,u)=>s(c,r.elements.length>1?[...o,u]:o,a,l));else if(r.type==="TOMLInlineTable")for(let c of r.body)s(c.value,[...o,...n(c.key)],a,c.key.loc.start.line);else if(r.kind==="integer"||r.kind==="float"){let c=r.kind==="integer";jf.test(i.slice(...r.range).replaceAll("_",""))&&t.push({from:r.range[0],to:r.range[1],whole:c,line:l,path:e(o),group:e(a)})}};for(let r of N_(i).body[0].body){let o=r.type==="TOMLTable"?r.body:[r],a=r.type==="TOMLTable"?r.resolvedKey:[];for(let l of o)s(l.value,[...a,...n(l.key)],a,l.key.loc.start.line)}return t}function Qf(i,t,e,n){let{from:s,to:r}=t[e],o=n.length-(r-s);for(let a of t)a.from>s&&(a.from+=o),a.to>s&&(a.to+=o);return i.slice(0,s)+n+i.slice(r)}var oE=400,fu=class{constructor(){this.first={text:Ot.text,file:Ot.file},this.text=Ot.text,this.past=[],this.future=[],this.form=F("form",{class:"controls",onsubmit:e=>e.preventDefault()}),this.editor=F("textarea",{spellcheck:!1,wrap:"off","aria-label":"the scenario as text",oninput:()=>this.typed()}),this.told=F("p",{class:"told",role:"status"}),this.note=F("p",{class:"hint",role:"status"});let t=(e,n,s)=>F("button",{type:"button",title:n,onclick:s},e);this.switch=t("text","The scenario as text, or its numbers with sliders",()=>this.turn()),this.tools=F("div",{class:"tools"},this.switch,t("\u21B6","Undo (Ctrl+Z)",()=>this.undo()),t("\u21B7","Redo (Ctrl+Y)",()=>this.redo()),t("as it was","The scenario as the program was given it",()=>this.set(this.first.text)),t("save TOML","The scenario with its changes, as a file",()=>this.save())),this.editor.hidden=!0,this.bench=F("section",{class:"bench"},this.tools,this.told,this.form,this.editor,this.note),this.place=F("section",{class:"place"},F("p",{class:"missing"},"The first frame is being simulated.")),this.element=F("main",{class:"live"},this.bench,this.place)}async start(){this.make_form(),await this.simulate()}turn(){this.settle(),this.editor.hidden=!this.editor.hidden,this.form.hidden=!this.editor.hidden,this.switch.textContent=this.editor.hidden?"text":"numbers",this.editor.hidden?this.make_form():this.editor.value=this.text}typed(){clearTimeout(this.timer),this.timer=setTimeout(()=>this.settle(),oE)}settle(){clearTimeout(this.timer),this.editor.hidden||this.set(this.editor.value,!1,!0)}set(t,e=!1,n=!1){t!==this.text&&((!e||!this.moving)&&this.past.push(this.text),this.moving=e,this.future=[],this.take(t,e,n))}take(t,e,n){this.text=t,!e&&this.editor.hidden&&this.make_form(),n||(this.editor.value=t),this.simulate()}undo(){this.past.length&&(this.future.push(this.text),this.take(this.past.pop()))}redo(){this.future.length&&(this.past.push(this.text),this.take(this.future.pop()))}make_form(){try{this.numbers=U_(this.text)}catch(n){this.numbers=[],this.form.replaceChildren(F("p",{class:"hint"},`The text is no TOML (${n.message}): mend it as text, or take the change back.`));return}let t=[],e;this.numbers.forEach((n,s)=>{let r=n.group.join(" ");r!==e&&t.push(F("h3",{},r||"scenario")),e=r,t.push(this.row(s,n))}),this.form.replaceChildren(...t),this.judge()}row(t,e){let n=this.text.slice(e.from,e.to),s=Number(n.replaceAll("_","")),r=e.path.join(" "),o=e.path.slice(e.group.length).join(" "),[a,l]=/^(.*?)( \d+)?$/.exec(o).slice(1),c=a.endsWith("_deg")?180:Math.max(Math.abs(s),e.whole?10:1),u=s-c,h=F("input",{type:"text",inputMode:"decimal",value:n,"aria-label":r,title:r,onchange:()=>{let m=h.value.trim().replace(",",".").replace(/^([+-]?)\./,"$10.").replace(/\.$/,".0");jf.test(m)?this.set(Qf(this.text,this.numbers,t,m),!1):(h.setAttribute("aria-invalid","true"),this.told.textContent=`${r} = ${h.value}: no number; allowed: decimal numbers, as 1.5, -3 or 76.5e9`)}}),d=F("input",{type:"range",min:0,max:1e3,value:500,"aria-label":`${r} by a slider`,title:r,oninput:()=>{let m=Number((u+2*c*Number(d.value)/1e3).toPrecision(4));h.value=e.whole?String(Math.round(m)):Number.isInteger(m)&&Math.abs(m)<1e15?m.toFixed(1):String(m),this.set(Qf(this.text,this.numbers,t,h.value),!0)},onchange:()=>{this.moving=!1}}),f=F("label",{class:"row",title:r},F("span",{},`${$s(a)}${l??""}${Oi(a)?` / ${Oi(a)}`:""}`),d,h);return f.dataset.line=e.line,f}async simulate(){if(this.busy){this.again=!0;return}this.busy=!0,this.element.classList.add("busy");let t=performance.now(),e;try{e=await(await fetch("simulate",{method:"POST",headers:{"Content-Type":"text/plain; charset=utf-8"},body:this.text})).json()}catch(n){e={error:`The program that serves this page does not answer (${n.message}). Start catseye view --live again; the scenario can be saved here.`}}if(e.error)this.complain(e.error);else try{await this.show(e),this.complain(""),this.note.textContent=`Simulated in ${jt(e.seconds,2)} s, drawn after ${jt((performance.now()-t)/1e3,2)} s.`}catch(n){this.complain(`The frame cannot be drawn: ${n.message}`)}this.busy=!1,this.element.classList.remove("busy"),this.done=(this.done??0)+1,this.again&&(this.again=!1,await this.simulate())}async show(t){let e=this.view&&JSON.stringify(Ot.radars?.map(n=>n.name))===JSON.stringify(t.data.radars.map(n=>n.name));if(bp(t.data,t.frames),e)return this.view.renew();this.view=new ra,this.place.replaceChildren(this.view.element),await this.view.start()}complain(t){this.told.textContent=t;let e=t.indexOf(`${this.first.file}:`);this.wrong=e<0?void 0:/^\d+/.exec(t.slice(e+this.first.file.length+1))?.[0],this.judge()}judge(){for(let t of this.form.querySelectorAll(".row")){let e=t.querySelector('input[type="text"]');this.wrong&&t.dataset.line===this.wrong?e.setAttribute("aria-invalid","true"):e.removeAttribute("aria-invalid")}}save(){this.settle();let t=F("a",{href:URL.createObjectURL(new Blob([this.text],{type:"application/toml"})),download:this.first.file});t.click(),setTimeout(()=>URL.revokeObjectURL(t.href),1e4)}key_press(t){this.view?.key_press(t)}shortcut(t){if(t.target===this.editor)return!1;if(t.key==="z")this.undo();else if(t.key==="y")this.redo();else return!1;return!0}theme(){this.view?.theme()}};function O_(i){let t=i.axes.frequency_hz,e=i.axes.azimuth_deg.map(a=>a*Math.PI/180),n=.5*(t[0]+t.at(-1)),s=a=>(a.at(-1)-a[0])/(a.length-1),r=299792458/(2*(t.at(-1)-t[0])),o=299792458/(2*n*2*Math.sin(.5*Math.min(Math.PI,e.at(-1)-e[0])));return{dx_m:r,dy_m:o,x_m:299792458/(2*s(t)),y_m:299792458/(2*n*s(e)),n:96}}function F_(i,t,{x_m:e,y_m:n,n:s}){let r=i.axes.frequency_hz,o=i.axes.azimuth_deg,a=(p,g)=>p.length<2?1:.5-.5*Math.cos(2*Math.PI*(p.indexOf(g)+.5)/p.length),l=new Float64Array(s*s),c=new Float64Array(s*s),u=0,h=Math.cos(t*Math.PI/180),[d,f,m,y]=[0,0,0,0].map(()=>new Float64Array(s));for(let p=0;p<i.frequency_hz.length;p++){if(i.elevation_deg[p]!==t||!Number.isFinite(i.vv_re_m[p]))continue;let g=a(r,i.frequency_hz[p])*a(o,i.azimuth_deg[p]);u+=g;let v=4*Math.PI*i.frequency_hz[p]*h/299792458,E=i.azimuth_deg[p]*Math.PI/180;for(let A=0;A<s;A++){let x=(A+.5)/s-.5,T=-v*Math.cos(E)*x*e,V=-v*Math.sin(E)*x*n;d[A]=Math.cos(T),f[A]=Math.sin(T),m[A]=Math.cos(V),y[A]=Math.sin(V)}let b=g*i.vv_re_m[p],I=g*i.vv_im_m[p];for(let A=0;A<s;A++){let x=b*d[A]-I*f[A],T=b*f[A]+I*d[A];for(let V=0,N=A*s;V<s;V++,N++)l[N]+=x*m[V]-T*y[V],c[N]+=x*y[V]+T*m[V]}}return Float64Array.from(l,(p,g)=>10*Math.log10(4*Math.PI*(p*p+c[g]*c[g])/(u*u)+1e-30))}var tp=[["vv","VV"],["hh","HH"],["vh","VH"],["hv","HV"]],Al={azimuth_deg:"azimuth / \xB0",elevation_deg:"elevation / \xB0",frequency_hz:"frequency / GHz"},ji=Object.keys(Al);function B_(i){let t={name:i.name,comments:i.comments??[]};for(let e of[...ji,...tp.map(([n])=>`${n}_dbsm`),"vv_re_m","vv_im_m"])t[e]=Vn(i[e]);return t.axes=Object.fromEntries(ji.map(e=>[e,[...new Set(t[e])].sort((n,s)=>n-s)])),t}function aE(i,t){let e=t.split(/\r?\n/).filter(u=>u.trim()!==""),n=e.filter(u=>u.startsWith("#")).map(u=>u.slice(1).trim()),[s,...r]=e.filter(u=>!u.startsWith("#")),o=(s??"").split(",").map(u=>u.trim()),a=[...ji,"vv_dbsm"],l=a.filter(u=>!o.includes(u));if(l.length)throw new Error(`${i} has no column ${l[0]}; a table of cross sections has ${a.join(", ")}.`);let c={name:i,comments:n};for(let u of[...ji,...tp.map(([h])=>`${h}_dbsm`)]){let h=o.indexOf(u);c[u]=r.map((d,f)=>{if(h<0)return NaN;let m=d.split(",")[h]?.trim(),y=m===""||m==null?NaN:Number(m==="inf"?1/0:m==="-inf"?-1/0:m);if(Number.isNaN(y)&&m&&m!=="NaN"&&m!=="nan")throw new Error(`${i}: row ${f+1} of ${u} is no number.`);return y})}if(!r.length)throw new Error(`${i} has no rows.`);return c}var pu=class{constructor(){this.tables=Ot.rcs.map(B_),this.pair="vv",this.axis=ji.reduce((s,r)=>this.tables[0].axes[r].length>this.tables[0].axes[s].length?r:s);let t=this.tables[0],e=t.vv_dbsm.reduce((s,r,o)=>r>t.vv_dbsm[s]||!Number.isFinite(t.vv_dbsm[s])?o:s,0);this.fixed=Object.fromEntries(ji.map(s=>[s,t.axes[s].indexOf(t[s][e])])),this.lines=new Zi({x:Al[this.axis],y:"cross section / dBsm",pick:s=>this.at(s)}),this.polar=xr((s,r,o)=>this.draw_polar(s,r,o)),this.polar.canvas.className="polar",this.map=new fr({name:"cross section over azimuth and elevation",unit:"dBsm",hover:(s,r)=>this.hover(s,r),pick:(s,r)=>this.pick(s,r)}),this.note=F("p",{class:"hint"}),this.shown="map",Ot.scene&&(this.body=new Li({pick:()=>{}})),this.tools=F("div",{class:"tools"}),this.names=F("div",{class:"names"});let n=F("input",{type:"file",accept:".csv",multiple:!0,hidden:!0,onchange:()=>this.take([...n.files])});this.element=F("main",{class:"rcs"},this.tools,this.names,F("div",{class:this.body?"cuts three":"cuts"},this.lines.box,this.polar.canvas,this.body?.box),this.map.box,F("div",{class:"note"},this.note,F("button",{onclick:()=>n.click()},"lay another CSV over it"),n,F("span",{class:"hint"}," or drop it here"))),this.element.addEventListener("dragover",s=>s.preventDefault()),this.element.addEventListener("drop",s=>{s.preventDefault(),this.take([...s.dataTransfer.files])})}async start(){this.body&&(this.body.set(Ot.scene),this.body.legend(Li.used(Ot.scene)),this.body.controls&&(this.body.controls.maxPolarAngle=Math.PI)),this.update(),this.turn(0,0)}turn(t,e){if(!this.body?.renderer)return;let[n,s]=this.body.bounds(),r=n.map((u,h)=>.5*(u+s[h])),o=Math.max(.01,Math.hypot(...n.map((u,h)=>s[h]-u)));Object.assign(this.body.camera,{near:o/1e3,far:20*o}),this.body.camera.updateProjectionMatrix();let[a,l]=[t*Math.PI/180,Math.min(89.9,Math.max(-89.9,e))*Math.PI/180],c=1.5*o;this.body.look(r,[r[0]+c*Math.cos(l)*Math.cos(a),r[1]+c*Math.cos(l)*Math.sin(a),r[2]+c*Math.sin(l)])}async take(t){for(let e of t)try{this.tables.push(B_(aE(e.name,await e.text())))}catch(n){this.note.textContent=n.message;return}this.note.textContent="",this.update()}update(){let t=this.tables[0],e=ji.filter(s=>t.axes[s].length>1),n=(s,r)=>s==="frequency_hz"?`${r/1e9} GHz`:`${jt(r,3).replace(/\.?0+$/,"")}\xB0`;this.tools.replaceChildren(...[fn("polarisation",tp,this.pair,s=>{this.pair=s,this.draw()}),this.can_image()&&fn("below",[["map","map over angles"],["image","image (ISAR)"]],this.shown,s=>{this.shown=s,this.draw_map()}),fn("along",ji.filter(s=>e.includes(s)||s===this.axis).map(s=>[s,Al[s].split(" ")[0]]),this.axis,s=>{this.axis=s,this.update()}),...ji.filter(s=>s!==this.axis&&t.axes[s].length>1).map(s=>{let r=F("input",{type:"range",min:0,max:t.axes[s].length-1,value:this.fixed[s],"aria-label":s,oninput:()=>{this.fixed[s]=Number(r.value),o.textContent=n(s,t.axes[s][this.fixed[s]]),this.draw()}}),o=F("output",{},n(s,t.axes[s][this.fixed[s]]));return F("label",{class:"menu"},F("span",{},Al[s].split(" ")[0]),r,o)})].filter(Boolean)),this.names.replaceChildren(...this.tables.map((s,r)=>F("span",{title:s.comments.join(`
`)},F("i",{style:`background:${ai(r)}`}),s.name))),this.draw()}cut(t){let e=this.tables[0],n=ji.filter(o=>o!==this.axis).map(o=>{let a=e.axes[o][Math.min(this.fixed[o],e.axes[o].length-1)];return[o,t.axes[o].reduce((l,c)=>Math.abs(c-a)<Math.abs(l-a)?c:l)]}),s=t[`${this.pair}_dbsm`],r=[];for(let o=0;o<s.length;o++)n.every(([a,l])=>t[a][o]===l)&&r.push([t[this.axis][o],s[o]]);return r.sort((o,a)=>o[0]-a[0])}draw(){let t=this.axis==="frequency_hz"?1e-9:1;this.cuts=this.tables.map(o=>this.cut(o).map(([a,l])=>[t*a,l]));let e=[...new Set(this.cuts.flat().map(([o])=>o))].sort((o,a)=>o-a),n=new Map(e.map((o,a)=>[o,a])),s=this.cuts.map((o,a)=>{let l=new Array(e.length).fill(null);for(let[c,u]of o)l[n.get(c)]=Number.isFinite(u)?u:null;if(o.length<e.length)for(let c=0;c<e.length;c++)l[c]===null&&!o.some(([u])=>u===e[c])&&(l[c]=void 0);return{label:`${this.tables[a].name} ${this.pair.toUpperCase()}`,colour:ai(a),values:l}});this.lines.labels.x=Al[this.axis],this.xs=e;let r=Math.max(...this.cuts.flat().map(([,o])=>o).filter(Number.isFinite));this.lines.show(e,s,{y:(o,a,l)=>[Math.max(a,r-60)-2,l+2]}),this.polar.canvas.hidden=this.axis==="frequency_hz",this.polar.redraw(),this.draw_map()}at(t){let e=this.xs?.[t];if(e==null)return;let n=Object.fromEntries(ji.map(s=>[s,this.tables[0].axes[s][Math.min(this.fixed[s],this.tables[0].axes[s].length-1)]]));this.axis!=="frequency_hz"&&(n[this.axis]=e),this.turn(n.azimuth_deg,n.elevation_deg),this.note.textContent=this.cuts.map((s,r)=>{let o=s.find(([a])=>a===e);return o?`${this.tables[r].name}: ${jt(o[1])} dBsm`:""}).filter(Boolean).join(" \xB7 ")+` at ${jt(e,3)}`}draw_polar(t,e,n){if(!this.cuts||this.axis==="frequency_hz")return;let s=this.cuts.flat().map(([,h])=>h).filter(Number.isFinite),r=Math.ceil(Math.max(...s)/10)*10,o=r-50,a=Math.min(e,n)/2-26,[l,c]=[e/2,n/2],u=(h,d)=>{let f=(this.axis==="azimuth_deg"?h+90:h)*Math.PI/180,m=a*Math.max(0,d-o)/(r-o);return[l+m*Math.cos(f),c-m*Math.sin(f)]};t.strokeStyle=Zn("grid"),t.fillStyle=Zn("ink"),t.font="11px system-ui",t.textAlign="center",t.textBaseline="middle";for(let h of io(o,r,5).list)t.beginPath(),t.arc(l,c,a*(h-o)/(r-o),0,2*Math.PI),t.stroke(),t.fillText(jt(h,0),...u(this.axis==="azimuth_deg"?180:-90,h));for(let h=-150;h<=180;h+=30){t.beginPath(),t.moveTo(l,c),t.lineTo(...u(h,r)),t.stroke();let[d,f]=u(h,r+14*(r-o)/a);t.fillText(`${jt(h,0)}\xB0`,d,f)}this.cuts.forEach((h,d)=>{t.strokeStyle=ai(d),t.lineWidth=1.5,t.beginPath();let f=!1;for(let[m,y]of h){if(!Number.isFinite(y)){f=!1;continue}let p=u(m,y);f?t.lineTo(...p):t.moveTo(...p),f=!0}t.stroke()})}can_image(){let t=this.tables[0];return t.axes.frequency_hz.length>=8&&t.axes.azimuth_deg.length>=8&&t.vv_re_m}draw_image(){let t=this.tables[0],e=t.axes.elevation_deg[Math.min(this.fixed.elevation_deg,t.axes.elevation_deg.length-1)],n=O_(t),s=F_(t,e,n),r=s.reduce((a,l)=>l>a?l:a,-1/0);this.grid=null;let o=(a,l,c)=>({label:a,first:-.5*l+.5*l/c,step:l/c});this.map.box.hidden=!1,this.map.show({columns:n.n,rows:n.n,at:(a,l)=>s[a*n.n+l],x:o("y / m, positive left",n.y_m,n.n),y:o("x / m, positive towards the radar at azimuth 0",n.x_m,n.n),low:r-40,high:r}),this.map.note.textContent=`VV, cells of ${jt(n.dx_m,3)} m along x and ${jt(n.dy_m,3)} m along y`}draw_map(){if(this.shown==="image"&&this.can_image())return this.draw_image();let t=this.tables[0],e=t.axes.azimuth_deg,n=t.axes.elevation_deg,s=u=>u.length>1&&u.every((h,d)=>Math.abs(h-u[0]-d*(u.at(-1)-u[0])/(u.length-1))<1e-6*(1+Math.abs(h))+.001*((u.at(-1)-u[0])/(u.length-1)));if(this.map.box.hidden=!(s(e)&&s(n)),this.map.box.hidden)return;let r=t.axes.frequency_hz[Math.min(this.fixed.frequency_hz,t.axes.frequency_hz.length-1)],o=new Float64Array(e.length*n.length).fill(NaN),a=t[`${this.pair}_dbsm`],l=u=>(u.at(-1)-u[0])/(u.length-1);for(let u=0;u<a.length;u++)t.frequency_hz[u]===r&&(o[Math.round((t.elevation_deg[u]-n[0])/l(n))*e.length+Math.round((t.azimuth_deg[u]-e[0])/l(e))]=Number.isFinite(a[u])?a[u]:NaN);let c=o.reduce((u,h)=>h>u?h:u,-1/0);this.grid={grid:o,a:e,e:n,step:l},this.map.show({columns:e.length,rows:n.length,at:(u,h)=>o[u*e.length+h],x:{label:"azimuth / \xB0",first:e[0],step:l(e)},y:{label:"elevation / \xB0",first:n[0],step:l(n)},low:c-50,high:c})}hover(t,e){if(t==null||!this.grid)return;let{grid:n,a:s,e:r}=this.grid;this.turn(s[e],r[t]),this.map.note.textContent=`azimuth ${jt(s[e])}\xB0, elevation ${jt(r[t])}\xB0: ${jt(n[t*s.length+e])} dBsm; a click cuts here`}pick(t,e){this.grid&&(this.fixed.azimuth_deg=e,this.fixed.elevation_deg=t,this.update())}key_press(){}theme(){this.body?.theme(),this.lines.again(),this.polar.redraw(),this.map.redraw()}};var mu=class{constructor(){this.scene=new Li({pick:n=>this.hit(n)}),this.details=F("div",{class:"details"});let t=n=>Ot.scene.objects.reduce((s,r)=>s.set(n(r),(s.get(n(r))??0)+1),new Map),e=(n,s,r)=>F("li",{},F("i",{style:`background:rgb(${n.join(",")})`}),`${s||"without a class"}: ${r}`);this.summary=[F("h2",{},Ot.title),F("p",{},`${Ot.scene.objects.length} objects, ${Ot.scene.meshes.length} meshes`),F("h3",{},"classes"),F("ul",{},[...t(n=>n.class)].map(([n,s])=>e(qi(n),n,s))),F("h3",{},"materials"),F("ul",{},Ot.scene.materials.map(n=>F("li",{},F("i",{style:`background:rgb(${Pr(n,"").join(",")})`}),n)))],this.element=F("main",{class:"thing"},F("section",{class:"left"},F("div",{class:"tools"},F("button",{onclick:()=>this.reset()},"all")),this.scene.box),F("section",{class:"right"},this.details))}async start(){this.scene.set(Ot.scene),this.scene.legend(Li.used(Ot.scene)),this.reset(),this.hit({})}reset(){let[t,e]=this.scene.bounds(),n=t.map((r,o)=>.5*(r+e[o])),s=Math.max(.02,Math.hypot(...t.map((r,o)=>e[o]-r)));this.scene.camera&&(this.scene.camera.near=s/1e3,this.scene.camera.far=20*s,this.scene.camera.updateProjectionMatrix()),this.scene.look(n,[n[0]+.9*s,n[1]-.5*s,n[2]+.5*s])}hit(t){let e=t.object;if(!e)return this.details.replaceChildren(...this.summary);this.details.replaceChildren(F("h2",{},e.name||`object ${e.id}`),F("dl",{class:"facts"},[["number",e.id],["class",e.class||"\u2013"],["material",Ot.scene.materials[t.material]??"\u2013"],["place",`${t.at.map(n=>jt(n,3)).join(", ")} m`]].flatMap(([n,s])=>[F("dt",{},n),F("dd",{},s)])),F("button",{onclick:()=>this.hit({})},"back to all"))}key_press(t){t.key==="r"&&this.reset(),t.key==="Escape"&&this.hit({})}theme(){this.scene.theme()}};var gu=12,ep=1e3;function Gr(i){return i==null||Number.isNaN(i)?"\u2013":Number.isFinite(i)?String(i).replace(/^-/,"\u2212"):i>0?"\u221E":"\u2212\u221E"}function k_(i){if(!i.numbers)return{values:i.names.map((e,n)=>n),names:i.names,label:i.label};let t=i.label.endsWith("(Hz)")&&i.numbers.every(e=>Math.abs(e)>=1e8);return{values:t?i.numbers.map(e=>e/1e9):i.numbers,label:t?i.label.replace("(Hz)","(GHz)"):i.label}}function lE(i){let t=(i.columns??[]).map(a=>({...a,at:Vn(a.at),cells:Vn(a.cells)})),e=t.filter(a=>a.at),n=t.filter(a=>a.cells&&!Array.isArray(a.cells)),s=[],r=1;for(let a of[...e].reverse())s.unshift(r),r*=a.names.length;let o=new Int32Array(e.length?r:0).fill(-1);for(let a=0;a<(i.rows??0);a++)o[e.reduce((l,c,u)=>l+c.at[a]*s[u],0)]=a;return{...i,columns:t,axes:e,fields:n,row_of:a=>o[a.reduce((l,c,u)=>l+c*s[u],0)]}}var _u=class{constructor(){this.studies=Ot.studies.map(lE),this.tools=F("div",{class:"tools"}),this.lines=new Zi({x:"",y:"",pick:t=>this.point(t)}),this.map=new fr({name:"values over two axes",unit:"",hover:(t,e)=>this.hover(t,e),pick:(t,e)=>this.take_cell(t,e)}),this.note=F("p",{class:"hint told-value"}),this.list=F("div",{class:"list"}),this.details=F("div",{class:"details"}),this.chart=F("div",{class:"chart"},this.lines.box,this.map.box),this.left=F("section",{class:"left"},this.tools,this.chart,this.note,this.list),this.element=F("main",{class:"study"},this.left,F("section",{class:"right"},this.details))}async start(){this.take(0)}take(t){this.which=t;let e=this.study=this.studies[t];this.row=null,this.sort={column:null,up:!0},this.field=Math.max(0,e.fields.findIndex(n=>n.name==="on_front")-1),this.x=0,this.over=e.axes.length>1?1:null,this.places=e.axes.map(()=>0),this.kind="lines",this.over!=null&&e.axes[1].names.length>gu&&(e.axes[1].numbers&&e.axes[0].numbers?this.kind="map":this.over=null),this.update()}update(){let t=this.study;this.controls();let e=t.axes.length>0&&t.fields.length>0;this.chart.hidden=!e&&!t.picture,this.note.textContent="",this.chart.querySelector("img")?.remove(),t.picture&&this.chart.append(F("img",{src:t.picture,alt:`Picture of ${t.title}`,class:"picture"})),this.lines.box.hidden=!e||this.kind!=="lines",this.map.box.hidden=!e||this.kind!=="map",e&&this.draw(),this.table(),this.tell()}controls(){let t=this.study,e=t.axes,n=o=>o.map((a,l)=>[String(l),a.label]),s=e.length>1;s&&this.kind==="map"&&this.over==null&&(this.over=e.findIndex((o,a)=>a!==this.x));let r=o=>a=>{this[o]=a===""?null:Number(a),this.over===this.x&&(this.over=o==="x"?e.findIndex((l,c)=>c!==this.x):null),this.update()};this.tools.replaceChildren(...[this.studies.length>1&&fn("study",n(this.studies.map(o=>({label:o.title}))),String(this.which),o=>this.take(Number(o))),t.fields.length>0&&e.length>0&&fn("show",n(t.fields),String(this.field),r("field")),s&&fn("as",[["lines","lines"],["map","map"]],this.kind,o=>{this.kind=o,this.update()}),e.length>0&&t.fields.length>0&&fn("along",n(e),String(this.x),r("x")),s&&fn(this.kind==="map"?"upward":"a line for each",[...this.kind==="map"?[]:[["","nothing"]],...n(e).filter(([o])=>Number(o)!==this.x)],this.over==null?"":String(this.over),r("over")),...e.map((o,a)=>{if(a===this.x||a===this.over||o.names.length<2)return null;let l=F("input",{type:"range",min:0,max:o.names.length-1,value:this.places[a],"aria-label":o.label,oninput:()=>{this.places[a]=Number(l.value),c.textContent=this.named(o,this.places[a]),this.draw()}}),c=F("output",{},this.named(o,this.places[a]));return F("label",{class:"menu"},F("span",{},o.label),l,c)})].filter(Boolean))}at(t,e){let n=[...this.places];return n[this.x]=t,this.over!=null&&(n[this.over]=e),this.study.row_of(n)}draw(){let t=this.study,e=t.fields[this.field],n=t.axes[this.x];if(this.kind==="map")return this.draw_map(e);let s=k_(n);this.order=s.values.map((h,d)=>d).sort((h,d)=>s.values[h]-s.values[d]);let r=this.over==null?null:t.axes[this.over],o=r?r.names.length:1,a=o<=gu?Array.from({length:o},(h,d)=>d):Array.from({length:gu},(h,d)=>Math.round(d*(o-1)/(gu-1)));this.drawn=a.map(h=>this.order.map(d=>this.at(d,h)));let l=a.map((h,d)=>({label:r?this.named(r,h):e.label,colour:ai(d),dash:d<7?void 0:[6,4],told:Gr,points:this.order.length===1,values:this.drawn[d].map(f=>f>=0&&Number.isFinite(e.cells[f])?e.cells[f]:null)}));this.shown=a,Object.assign(this.lines.labels,{x:s.label,y:e.label});let c=this.row==null?[]:[{x:s.values[n.at[this.row]],colour:"#ff2d55"}];this.lines.show(this.order.map(h=>s.values[h]),l,{names:s.names,marks:c,title:r?`a line for each ${r.label}`:void 0});let u=this.drawn.flat().filter(h=>h>=0&&!Number.isFinite(e.cells[h])).length;this.hint=[o>a.length&&`${a.length} of ${o} lines are drawn; the map and the table have all.`,u>0&&`${u} of the values are missing or infinite, and are gaps.`].filter(Boolean).join(" "),this.note.textContent=this.hint}draw_map(t){let e=this.study,[n,s]=[e.axes[this.x],e.axes[this.over]],r=h=>{let d=k_(h),f=d.values,m=(f.at(-1)-f[0])/Math.max(1,f.length-1)||1;return!d.names&&f.every((p,g)=>Math.abs(p-f[0]-g*m)<1e-6*Math.abs(m)*f.length)&&m>0?{label:d.label,first:f[0],step:m}:{label:d.label,first:0,step:1,names:h.names}},o=(h,d)=>{let f=this.at(d,h);return f<0?NaN:t.cells[f]},a=1/0,l=-1/0;for(let h=0;h<s.names.length;h++)for(let d=0;d<n.names.length;d++){let f=o(h,d);Number.isFinite(f)&&([a,l]=[Math.min(a,f),Math.max(l,f)])}l>a||([a,l]=Number.isFinite(a)?[a-1,a+1]:[0,1]),this.map.unit=/\(([^()]*)\)$/.exec(t.label)?.[1]??"",this.map.show({columns:n.names.length,rows:s.names.length,at:o,x:r(n),y:r(s),low:a,high:l});let c=this.row,u=(h,d)=>{let f=e.axes[d].at[c];return h.first+f*h.step};this.map.mark_all(c==null?[]:[{x:u(this.map.map.x,this.x),y:u(this.map.map.y,this.over),colour:"#ff2d55",shape:"ring",id:c}],c),this.map.note.textContent="Point at a cell for its value; a click chooses its row of the table."}point(t){let e=this.study,n=e.fields[this.field],s=e.axes[this.x],r=this.order?.[t];if(r==null||this.kind!=="lines")return;let o=this.over==null?null:e.axes[this.over];this.note.textContent=`${s.label} = ${this.named(s,r)}: `+this.drawn.map((a,l)=>`${o?`${this.named(o,this.shown[l])}: `:""}${Gr(n.cells[a[t]])}`).join(" \xB7 ")}hover(t,e){if(t==null)return this.map.note.textContent="";let n=this.study,[s,r]=[n.axes[this.x],n.axes[this.over]];this.map.note.textContent=`${s.label} = ${this.named(s,e)}, ${r.label} = ${this.named(r,t)}: ${Gr(n.fields[this.field].cells[this.at(e,t)])}`}take_cell(t,e){let n=this.at(e,t);n>=0&&this.choose(n)}named(t,e){return t.numbers&&Number(t.names[e])===t.numbers[e]?Gr(t.numbers[e]):t.names[e]}told(t,e){return t.at?this.named(t,t.at[e]):typeof t.cells[e]=="number"?Gr(t.cells[e]):t.cells[e]}value(t,e){return t.at?t.numbers?.[t.at[e]]??t.names[t.at[e]]:t.cells[e]}spec(t){let{specs:e=[],of_row:n=[]}=this.study.reflectors??{};return e[n.length?n[t]:0]}ordered(){let t=Array.from({length:this.study.rows??0},(a,l)=>l),{column:e,up:n}=this.sort;if(e==null)return t;let s=this.study.columns[e],r=t.map(a=>this.value(s,a)),o=a=>a===""||a==null||Number.isNaN(a);return t.sort((a,l)=>{let[c,u]=[r[a],r[l]];if(o(c)||o(u))return o(c)-o(u)||a-l;let h=typeof c=="number"&&typeof u=="number"?c<u?-1:c>u?1:0:String(c).localeCompare(String(u));return(n?h:-h)||a-l})}table(){let t=this.study;if(this.list.hidden=!t.columns.length,!t.columns.length)return this.list.replaceChildren();let e=this.ordered(),n=this.spec(0)!=null,s=t.columns.map((o,a)=>{let l=this.sort.column===a,c=()=>{this.sort={column:a,up:l?!this.sort.up:!0},this.table()};return F("th",{"aria-sort":l?this.sort.up?"ascending":"descending":"none"},F("button",{onclick:c,title:`${o.name}: sort by it`},o.label,l?this.sort.up?" \u25B2":" \u25BC":""))}),r=F("tbody");for(let o of e.slice(0,ep)){let a=F("tr",{class:o===this.row?"on":"",onclick:()=>this.choose(o)},t.columns.map(l=>F("td",{},this.told(l,o))),n&&F("td",{},F("button",{title:this.spec(o),onclick:l=>{l.stopPropagation(),this.choose(o),this.copy(this.spec(o))}},"copy")));a.dataset.row=o,r.append(a)}this.list.replaceChildren(F("table",{},F("thead",{},F("tr",{},s,n&&F("th",{},"reflector"))),r),e.length>ep?F("p",{class:"hint"},`The first ${ep} of ${e.length} rows in this order; the plot has all.`):"")}choose(t){this.row=t,t!=null&&(this.places=this.study.axes.map(n=>n.at[t])),this.controls(),(!this.lines.box.hidden||!this.map.box.hidden)&&this.draw(),this.list.querySelector("tr.on")?.classList.remove("on"),(t==null?null:this.list.querySelector(`tr[data-row="${t}"]`))?.classList.add("on"),this.tell()}async copy(t){try{await navigator.clipboard.writeText(t),this.copied.textContent="copied"}catch{let e=document.createRange();e.selectNodeContents(this.details.querySelector("code")),getSelection().removeAllRanges(),getSelection().addRange(e),this.copied.textContent=document.execCommand("copy")?"copied":"selected: copy it with Ctrl+C"}}tell(){let t=this.study,e=t.facts.filter(l=>l.agrees!=null),n=e.filter(l=>l.agrees).length,s=l=>F("ul",{},l.map(c=>F("li",{},c))),r=l=>l.agrees==null?F("td",{class:"soft"},"not judged"):F("td",{class:l.agrees?"passed":"failed"},l.agrees?"\u2713 passed":"\u2717 not passed"),o=(l,c)=>typeof l=="string"?l:l==null?"\u2013":`${cE(l)} ${c}`.trim();this.copied=F("span",{class:"hint",role:"status"});let a=this.row==null?null:this.spec(this.row);this.details.replaceChildren(...[F("h2",{},t.title),t.reference&&F("p",{class:"hint"},`Set beside ${t.reference}.`),t.error&&F("p",{class:"told"},`It did not run: ${t.error}`),t.picture&&F("p",{class:"hint"},"The folder holds no table of this study, so that its picture alone is shown."),this.row!=null&&F("h3",{},`Row ${this.row+1}`),this.row!=null&&F("dl",{class:"facts"},t.columns.flatMap(l=>[F("dt",{},l.label),F("dd",{},this.told(l,this.row))])),a&&F("div",{class:"spec"},F("code",{},a),F("button",{onclick:()=>this.copy(a)},"copy"),this.copied),a&&F("p",{class:"hint"},"catseye view with this text, in quotes, opens the page in which it can be changed."),this.row==null&&t.columns.length>0&&F("p",{class:"hint"},`Click a row of the table${this.spec(0)?": its reflector stands here as text to copy":" for its values"}.`),t.facts.length>0&&F("h3",{},e.length?`Facts: ${n} of ${e.length} that can be judged are passed`:"Facts, all in words, which are not judged"),t.facts.length>0&&F("table",{class:"judged"},F("thead",{},F("tr",{},["fact","document","here",""].map(l=>F("th",{},l)))),F("tbody",{},t.facts.map(l=>F("tr",{title:l.why},F("td",{},l.text,l.why&&F("div",{class:"hint"},l.why)),F("td",{},o(l.document,l.unit)),F("td",{title:Gr(l.ours)},o(l.ours,l.unit)),r(l))))),t.facts.length>0&&F("p",{class:"hint"},"Levels pass within 1 dB, other numbers within a tenth of the document's."),t.remarks.length>0&&F("h3",{},"Remarks"),t.remarks.length>0&&s(t.remarks),t.settings?.length>0&&F("h3",{},"Settings"),t.settings?.length>0&&s(t.settings),t.source&&F("details",{},F("summary",{},"the study's file"),F("pre",{},t.source))].filter(Boolean))}key_press(t){let e=n=>this.studies.length>1&&this.take((this.which+n+this.studies.length)%this.studies.length);t.key==="n"&&e(1),t.key==="p"&&e(-1),t.key==="Escape"&&this.row!=null&&this.choose(null),(t.key==="l"||t.key==="m")&&this.study.axes.length>1&&(this.kind=t.key==="m"?"map":"lines",this.update())}theme(){this.lines.again(),this.map.redraw()}};function cE(i){return Gr(Number(i.toPrecision(4)))}var hE={run:"space play \xB7 \u2190 \u2192 frames \xB7 n p points \xB7 1\u20134 panes \xB7 r behind \xB7 t above \xB7 d dark or light \xB7 Esc nothing chosen",rcs:"d dark or light",design:"Ctrl+Z undo \xB7 Ctrl+Y redo \xB7 r along the strongest direction \xB7 d dark or light",study:"n p studies \xB7 l lines \xB7 m map \xB7 d dark or light \xB7 Esc no row",live:"Ctrl+Z undo \xB7 Ctrl+Y redo \xB7 space play \xB7 \u2190 \u2192 frames \xB7 n p points \xB7 1\u20134 panes \xB7 r behind \xB7 t above \xB7 d dark or light",scene:"r all of it \xB7 d dark or light \xB7 Esc back"},uE=window.matchMedia("(prefers-color-scheme: dark)"),xu=uE.matches?"dark":"light";document.documentElement.dataset.theme=xu;var Hr=new{run:ra,rcs:pu,scene:mu,study:_u,design:ou,live:fu}[Ot.kind];function V_(){xu=xu==="dark"?"light":"dark",document.documentElement.dataset.theme=xu,Hr.theme()}var z_=Ot.about?.engine;document.body.append(F("header",{},F("h1",{},Ot.title),F("span",{class:"about"},Ot.about?[`catseye ${Ot.about.catseye}`,z_?.adapter??z_?.engine,Ot.about.seed!=null&&`seed ${Ot.about.seed}`].filter(Boolean).join(" \xB7 "):""),F("span",{class:"keys"},hE[Ot.kind]),F("button",{onclick:V_,title:"Dark or light (d)"},"\u25D0")),Hr.element);Ot.about?.remarks?.length&&document.querySelector("header").append(F("span",{class:"remarks",title:Ot.about.remarks.join(`
`)},`${Ot.about.remarks.length} remarks`));document.addEventListener("keydown",i=>{if((i.ctrlKey||i.metaKey)&&Hr.shortcut?.(i))return i.preventDefault();i.target.closest("select, textarea, input:not([type=checkbox])")||i.ctrlKey||i.metaKey||i.altKey||(i.key==="d"?V_():Hr.key_press(i))});window.catseye={data:Ot,view:Hr,ready:!1};Hr.start().then(()=>window.catseye.ready=!0,i=>{Hr.element.replaceChildren(F("p",{class:"missing"},`This page cannot start: ${i.message}`))});})();
